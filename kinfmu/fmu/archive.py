"""The zip archive of an FMU: reproducible bytes, and the token that identifies them."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

from kinfmu.errors import FmuError
from kinfmu.files import errors_of_writing, write_whole

EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date that a zip archive can hold


def write(path: Path, data: bytes) -> None:
    """Write the whole file or none, so that a host never reads an incomplete FMU."""
    with errors_of_writing(path, FmuError):
        write_whole(path, data)


def digest(contents: Mapping[str, bytes]) -> str:
    """Return the SHA-256 of files and their paths.

    Args:
        contents: Files by path.

    Returns:
        64 hexadecimal digits.

    """
    return hashlib.sha256(b"".join(name.encode() + b"\0" + data for name, data in contents.items())).hexdigest()


def token(digits: str) -> str:
    """Return a hash in the form of a GUID: '{xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx}'."""
    return "{" + "-".join((digits[:8], digits[8:12], digits[12:16], digits[16:20], digits[20:32])) + "}"


def zipped(contents: Mapping[str, bytes], first: str = "modelDescription.xml") -> bytes:
    """Return a zip archive with fixed dates, permissions, system and order.

    Args:
        contents: Files by path.
        first: The file that comes first in the archive. Default: that of an FMU.

    Returns:
        Bytes of the archive.

    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in (first, *sorted(contents.keys() - {first})):
            entry = zipfile.ZipInfo(path, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix: it holds the permissions that follow
            entry.external_attr = (0o100755 if path.startswith("binaries/") else 0o100644) << 16
            archive.writestr(entry, contents[path])
    return buffer.getvalue()
