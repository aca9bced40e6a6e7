"""Files that appear complete or not at all: written under a temporary name, then renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kinfmu.errors import LogError
from kinfmu.files import check_is_free, hidden_sibling, make_folder, remove_folders, replacement


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield an empty file in the folder of `path`, which replaces `path` when the block ends without an error.

    Missing folders are made. After a failure `path` is unchanged. LogError for a folder that cannot be written.
    """
    target = target_of(path)
    try:
        with replacement(target) as temporary:
            yield temporary
    except OSError as error:
        raise write_error(path, error) from error


def target_of(path: str | Path) -> Path:
    """Return where a file of that name is or will be, the target of a link; LogError if no file can be there."""
    target = Path(os.path.realpath(path))  # the link is kept
    if target.is_dir():
        raise LogError(f"{path}: is a folder; the name of a file is needed")
    if target.exists() and not target.is_file():
        raise LogError(f"{path}: is a device or a pipe, which a file would replace; the name of a file is needed")
    return target


def check_writable(path: str | Path) -> None:
    """Raise a LogError if no file can be made at `path`, or if another run is being written to it; leave nothing."""
    target = target_of(path)
    temporary = hidden_sibling(target)
    made: list[Path] = []
    try:
        made = make_folder(target.parent)
        check_is_free(target)
        temporary.open("xb").close()
        temporary.unlink()
    except OSError as error:
        raise write_error(path, error) from error
    finally:
        remove_folders(made)


def write_error(path: str | Path, error: OSError, more: str = "") -> LogError:
    """Return the error for a file that cannot be written; more: added to its message."""
    return LogError(f"{path}: cannot be written ({error.strerror or error}){more}")
