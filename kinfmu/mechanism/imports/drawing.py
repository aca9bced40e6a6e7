"""imported(): a drawing of another program as a mechanism file.

To add a format, write a file with its reader and add a line to `_READERS`.
"""

from __future__ import annotations

from pathlib import PurePath
from typing import NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.imports.dxf import is_dxf, sketch_of_dxf
from kinfmu.mechanism.imports.linkage import is_xml, sketch_of_linkage
from kinfmu.mechanism.imports.pmks import is_pmks_link, sketch_of_pmks
from kinfmu.mechanism.toml_document import LARGEST_FILE

_FORMATS = "a link of PMKS+, a .linkage2 file of Linkage, or a DXF drawing"
_READERS = (  # whether a text has a format, and the reader of that format
    (is_pmks_link, sketch_of_pmks),
    (is_xml, sketch_of_linkage),
    (is_dxf, sketch_of_dxf),
)


class Imported(NamedTuple):
    """A drawing of another program as a mechanism file.

    Attributes:
        text: The mechanism file (TOML); its first lines are comments with the notes.
        notes: What was left out, or chosen where the drawing does not determine it; one line each.

    """

    text: str
    notes: tuple[str, ...]


def imported(data: bytes | str, name: str = "") -> Imported:
    """Return a drawing of another program as a mechanism file; the content shows its format.

    Points are in world coordinates, and every body has start = 0 in the drawn pose.

    Args:
        data: A link of PMKS+, or the content of a .linkage2 file of Linkage or of a DXF drawing.
        name: Name of the file, for messages and for the name of the mechanism. Default: of its format.

    Raises:
        MechanismError: The data is none of these formats, damaged, too large, or no mechanism; one line with the place.
        MissingPackageError: A DXF drawing, and ezdxf is not installed.

    """
    where = name or "the drawing"
    try:
        content = _text_of(data)
        for is_format, sketch_of in _READERS:
            if is_format(content):
                sketch = sketch_of(content, PurePath(name).stem)
                text = sketch.file_text()
                return Imported(text, tuple(sketch.notes))
        raise MechanismError(f"is not {_FORMATS}")
    except MechanismError as error:
        raise type(error)(f"{where}: {error}", **error.data) from None


def _text_of(data: bytes | str) -> str:
    """Return data as text without a byte order mark and outer blanks."""
    if len(data) > LARGEST_FILE:
        raise MechanismError(f"too large for a drawing to import (largest: {LARGEST_FILE} bytes)")
    if isinstance(data, bytes):
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            text = data.decode("utf-16", errors="replace")
        elif b"\x00" in data:
            raise MechanismError(f"is a binary file, not {_FORMATS}; save a binary DXF drawing as a text DXF")
        else:
            try:
                text = data.decode("utf-8-sig")
            except UnicodeDecodeError:
                text = data.decode("cp1252", errors="replace")  # what older programs write on Windows
    else:
        text = data
    return text.removeprefix("\ufeff").strip()
