"""Files appear whole or not at all: written beside the target under a temporary name, then renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kinfmu.errors import LogError
from kinfmu.files.whole_file import check_is_free, hidden_sibling, replacement


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """An empty file beside `path` to write into; it takes the place of `path` when the block ends without an error.

    A failure loses nothing: what stood at `path` before still stands there. A folder that is missing or cannot be
    written is a LogError.
    """
    target = checked(path)
    try:
        with replacement(target) as temporary:
            yield temporary
    except OSError as error:
        raise unwritable(path, error) from error


def checked(path: str | Path) -> Path:
    """Where a file of that name is, or is to be: the end of a link; LogError if none can be there."""
    target = Path(os.path.realpath(path))  # a link stays a link
    if target.is_dir():
        raise LogError(f"{path}: is a folder; the name of a file is needed")
    if not target.parent.is_dir():
        raise LogError(f"{path}: the folder '{target.parent}' does not exist")
    if target.exists() and not target.is_file():
        raise LogError(f"{path}: is a device or a pipe, which a file would replace; the name of a file is needed")
    return target


def check_room(path: str | Path) -> None:
    """LogError if no file can be made where `path` is to be, or if another run is being written to it."""
    target = checked(path)
    temporary = hidden_sibling(target)
    try:
        check_is_free(target)
        temporary.open("xb").close()
        temporary.unlink()
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: str | Path, error: OSError, more: str = "") -> LogError:
    """What is told when a file cannot be written."""
    return LogError(f"{path}: cannot be written ({error.strerror or error}){more}")
