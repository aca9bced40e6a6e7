"""Loading mechanisms by name or file, and saving them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kinfmu.errors import MechanismError, RequestError, valid_names
from kinfmu.files import errors_of_writing, suffix_of, write_whole
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery.chains import CHAINS, chain
from kinfmu.mechanism.toml_document import text_of
from kinfmu.mechanism.toml_file import read
from kinfmu.mechanism.toml_text import text
from kinfmu.mechanism.valid import quoted


def folder() -> Path:
    """Return the folder of the gallery: `fmus/` of a checkout, or inside the installed package."""
    package = Path(__file__).parents[2]
    installed, checkout = package / "fmus", package.parent / "fmus"
    return installed if installed.is_dir() else checkout


def names() -> list[str]:
    """Return the names of the gallery's mechanisms."""
    return sorted(path.parent.name for path in folder().glob("*/mechanism.toml"))


def has(name: str) -> bool:
    """Return True for a name that `load` accepts: of the gallery, or of a chain such as 'fourbar_chain:1000'."""
    return name in names() or (name.partition(":")[0] in CHAINS and ":" in name)


def load(mechanism: str | Path) -> Mechanism:
    """Load a mechanism.

    Args:
        mechanism: A name of the gallery ('fourbar'), a chain with its length ('fourbar_chain:1000'), or the path of a
            mechanism file (.toml).

    Returns:
        The mechanism.

    Raises:
        RequestError: The name is unknown.
        MechanismError: The file cannot be read or its mechanism is invalid.

    """
    if isinstance(mechanism, str) and suffix_of(mechanism) != ".toml" and "/" not in mechanism:
        name, colon, count = mechanism.partition(":")
        if colon and name in CHAINS:
            return chain(name, count)
        known = names()
        if mechanism not in known:
            raise RequestError(
                f"{quoted(mechanism)} is not in the gallery{valid_names(mechanism, known, 'gallery')}; "
                f"files end in .toml"
            )
        return read(folder() / mechanism / "mechanism.toml")
    return read(mechanism)


def load_named_in(document: Mapping[str, Any], folder: Path) -> Mechanism:
    """Return the mechanism that the key 'mechanism' of a study or fit file names.

    Raise a RequestError if the name is unknown, a MechanismError if there is none or the mechanism is invalid.

    document: The content of the file. folder: Its folder, where a relative path starts.
    """
    if "mechanism" not in document:
        raise MechanismError(
            "mechanism is missing: a mechanism file, such as mechanism = 'fourbar.toml', or a gallery name"
        )
    name = text_of("mechanism", document["mechanism"], "a file or a gallery name")
    is_file = suffix_of(name) == ".toml" or "/" in name
    return load(folder / name if is_file else name)


def save(mechanism: Mechanism, path: str | Path) -> Path:
    """Write a mechanism file, which `load` reads as the same mechanism; numbers keep the units of its file.

    Args:
        mechanism: The mechanism.
        path: Path of the file; an older file is replaced.

    Returns:
        The path.

    Raises:
        MechanismError: The file cannot be written.

    """
    path = Path(path)
    with errors_of_writing(path, MechanismError):
        write_whole(path, text(mechanism, as_written=True).encode())
    return path
