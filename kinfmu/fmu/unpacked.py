"""Unpack FMUs of unknown origin: damage is reported in one line, and FMUs that are too large are not unpacked."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kinfmu.errors import FmuError
from kinfmu.files import temporary_folder
from kinfmu.mechanism.toml_document import LARGEST_FILE
from kinfmu.mechanism.valid import quoted

LARGEST = 2**29  # [bytes] unpacked; the largest FMUs of kinfmu take a tenth of it
LARGEST_DESCRIPTION = 2**27  # [bytes]; enough for a chain of thousands of links
MOST_FILES = 10_000
DESCRIPTION, MECHANISM = "modelDescription.xml", "resources/mechanism.toml"
_ENCRYPTED = 1  # bit of the flags of a file in a zip archive
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    RuntimeError,  # NotImplementedError is one: a compression that zipfile does not support
    ValueError,
    OverflowError,
)


@contextmanager
def unpacked(path: Path, needed: str = DESCRIPTION) -> Iterator[Path]:
    """Unpack an FMU, or another archive of this kind, into a temporary folder, which is removed at the end.

    Args:
        path: File of the FMU.
        needed: Name of a file that it must hold.

    Yields:
        The folder.

    Raises:
        FmuError: If the file is not an FMU, is damaged, or is larger than LARGEST when unpacked.

    """
    with temporary_folder() as folder:
        try:
            with zipfile.ZipFile(path) as zipped:
                _check(path, zipped, needed)
                for entry in zipped.infolist():
                    _extract(path, zipped, entry, folder)
        except _DAMAGED as error:
            reason = "not a zip archive" if not zipfile.is_zipfile(path) else f"damaged: {_one_line(error)}"
            raise FmuError(f"{path}: is no FMU ({reason})") from None
        except OSError as error:
            raise FmuError(f"{path}: cannot be read ({error.strerror or error})") from None
        yield folder


def text_in(path: Path, folder: Path, name: str, largest: int = LARGEST_FILE) -> str:
    """Return the text of a file of an unpacked FMU.

    Args:
        path: File of the FMU, for messages.
        folder: Folder into which it was unpacked.
        name: Path of the file inside the FMU.
        largest: Largest size [bytes].

    Raises:
        FmuError: If the file is missing, is too large, or is not UTF-8.

    """
    try:
        with (folder / name).open("rb") as file:
            content = file.read(largest + 1)
    except OSError:
        raise FmuError(f"{path}: {name} is missing; kinfmu simulates FMUs that kinfmu built") from None
    if len(content) > largest:
        raise FmuError(f"{path}: {name} is too large (largest: {largest} bytes)")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FmuError(f"{path}: {name} is not a text file (byte {error.start} is not UTF-8)") from None


def _check(path: Path, zipped: zipfile.ZipFile, needed: str) -> None:
    """Raise an FmuError for an FMU that is not unpacked; sizes are those in the directory, the most that is read."""
    entries = zipped.infolist()
    if len(entries) > MOST_FILES:
        raise FmuError(f"{path}: holds {len(entries)} files; an FMU has at most {MOST_FILES}")
    if not all(entry.filename for entry in entries):
        raise FmuError(f"{path}: is no FMU (damaged: a file without a name)")
    size = sum(entry.file_size for entry in entries)
    if size > LARGEST:
        raise FmuError(f"{path}: takes {size} bytes unpacked; an FMU has at most {LARGEST}")
    if needed not in zipped.namelist():
        raise FmuError(f"{path}: is no {'FMU' if needed == DESCRIPTION else 'SSP'} ({needed} is missing)")


def _extract(path: Path, zipped: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path) -> None:
    """Write one file below `folder`; raise an FmuError for a path outside it."""
    target = (folder / entry.filename).resolve()
    if not target.is_relative_to(folder.resolve()):
        raise FmuError(f"{path}: is no FMU (file {quoted(entry.filename)} lies outside its folder)")
    if entry.flag_bits & _ENCRYPTED:
        raise FmuError(f"{path}: file {quoted(entry.filename)} is encrypted; FMUs are not")
    try:
        zipped.extract(entry, folder)
    except _DAMAGED as error:
        raise FmuError(f"{path}: file {quoted(entry.filename)} is damaged: {_one_line(error)}") from None
    except OSError as error:
        raise FmuError(
            f"{path}: file {quoted(entry.filename)} cannot be unpacked ({error.strerror or error})"
        ) from None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
