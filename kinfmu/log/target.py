"""Files appear whole or not at all: written beside the target under a temporary name, then renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from kinfmu.errors import LogError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """An empty file beside `path` to write into; it takes the place of `path` when the block ends without an error.

    The run is in memory until then, so a failure loses nothing: what stood at `path` before still stands there. A
    folder that is missing or cannot be written is a LogError.
    """
    path = Path(path)
    target = Path(os.path.realpath(path))  # a link stays a link
    if target.is_dir():
        raise LogError(f"{path}: is a folder; the name of a file is needed")
    if not target.parent.is_dir():
        raise LogError(f"{path}: the folder '{target.parent}' does not exist")
    temporary = target.with_name(f".{target.stem}.{uuid4().hex[:8]}{target.suffix}")
    try:
        temporary.open("xb").close()  # not tempfile: its files are readable by nobody else
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise LogError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
