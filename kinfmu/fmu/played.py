"""documentation/play.html of an FMU: the page in which its mechanism is dragged, linked from index.html."""

from __future__ import annotations

import zipfile
from pathlib import Path

from kinfmu.errors import FmuError
from kinfmu.files import write_whole
from kinfmu.fmu.archive import zipped

PLACE = "documentation/play.html"
_INDEX = "documentation/index.html"
_LINK = (
    b'<p><a href="play.html">Drag the mechanism</a>: a page with the compiled code of this FMU, without a net.</p>\n'
)


def add_page(path: Path, page: str) -> None:
    """Put the page of a mechanism into its FMU; the same page gives the same bytes.

    The token of the FMU stays: it identifies what is computed.

    Raises:
        FmuError: The file cannot be read or written.

    """
    try:
        with zipfile.ZipFile(path) as given:
            contents = {name: given.read(name) for name in given.namelist()}
        before, end, after = contents[_INDEX].rpartition(b"</body>")
        contents[_INDEX] = before + _LINK + end + after
        write_whole(path, zipped(contents | {PLACE: page.encode()}))
    except OSError as error:
        raise FmuError(f"{path}: cannot be written ({error.strerror})") from None
