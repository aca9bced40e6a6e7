"""FMUs of unknown origin, unpacked: damage is reported in one line, and what is too large is not unpacked."""

from __future__ import annotations

import lzma
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kinfmu.errors import FmuError
from kinfmu.mechanism.quoted import quoted
from kinfmu.mechanism.toml_file import LARGEST_FILE

LARGEST = 2**29  # [bytes] unpacked; the largest of our own take a tenth of it
LARGEST_DESCRIPTION = 2**27  # [bytes]; of a chain of thousands of links
MOST_FILES = 10_000
DESCRIPTION, MECHANISM = "modelDescription.xml", "resources/mechanism.toml"
_ENCRYPTED = 1  # of the flags of a file in a zip archive
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    RuntimeError,  # as NotImplementedError a compression that zipfile does not know
    ValueError,
    OverflowError,
)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Unpack an FMU into a temporary folder, which is removed at the end.

    Raises an FmuError for a file that is no FMU, is damaged, or would take more room than LARGEST.
    """
    with tempfile.TemporaryDirectory(prefix="kinfmu_", ignore_cleanup_errors=True) as folder:
        try:
            with zipfile.ZipFile(path) as zipped:
                _check(path, zipped)
                for entry in zipped.infolist():
                    _extract(path, zipped, entry, folder)
        except _DAMAGED as error:
            reason = "not a zip archive" if not zipfile.is_zipfile(path) else f"damaged: {_one_line(error)}"
            raise FmuError(f"{path}: is no FMU ({reason})") from None
        except OSError as error:
            raise FmuError(f"{path}: cannot be read ({error.strerror or error})") from None
        yield Path(folder)


def text_in(path: Path, folder: Path, name: str, largest: int = LARGEST_FILE) -> str:
    """Return the text of a file of the FMU that was unpacked into `folder`.

    Raises an FmuError if there is none, it is too large, or it is not UTF-8.
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
        raise FmuError(f"{path}: {name} is no text file (byte {error.start} is not UTF-8)") from None


def _check(path: Path, zipped: zipfile.ZipFile) -> None:
    """Raise an FmuError for what is not unpacked: sizes are those of the directory, beyond which nothing is read."""
    entries = zipped.infolist()
    if len(entries) > MOST_FILES:
        raise FmuError(f"{path}: holds {len(entries)} files; an FMU has at most {MOST_FILES}")
    if not all(entry.filename for entry in entries):
        raise FmuError(f"{path}: is no FMU (damaged: a file without a name)")
    size = sum(entry.file_size for entry in entries)
    if size > LARGEST:
        raise FmuError(f"{path}: takes {size} bytes unpacked; an FMU has at most {LARGEST}")
    if DESCRIPTION not in zipped.namelist():
        raise FmuError(f"{path}: is no FMU ({DESCRIPTION} is missing)")


def _extract(path: Path, zipped: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: str) -> None:
    """Write one file below `folder`; a place outside it is refused."""
    target = Path(folder, entry.filename).resolve()
    if not target.is_relative_to(Path(folder).resolve()):
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
