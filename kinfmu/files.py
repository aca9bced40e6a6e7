"""Files that are written completely or not at all, suffixes of their names, and temporary folders.

A file is written next to its target under a hidden name, then renamed. Missing folders of a target are made, and
removed again if the file is not written.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from uuid import uuid4

try:
    import fcntl
except ImportError:  # Windows, where a file that is open cannot be replaced
    fcntl = None  # type: ignore[assignment]

PATIENCE = 5.0  # [s] to wait for the lock of a folder, which is held for less than a millisecond


class BeingWrittenError(OSError):
    """Another process, or another sink of this process, writes to the file."""

    def __init__(self) -> None:
        super().__init__("a run in progress writes to it; choose another name, or wait until it has ended")
        self.strerror = self.args[0]


def write_whole(path: str | Path, data: bytes, *, is_durable: bool = False) -> None:
    """Write a file; an OSError leaves an older file unchanged. A device such as /dev/stdout is written to directly.

    is_durable: True to return only when the file is on the disk, so that a power failure loses neither content.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    target = Path(os.path.realpath(path))  # a link stays a link
    with replacement(target) as temporary, temporary.open("wb") as file:
        file.write(data)
        if is_durable:
            file.flush()
            os.fsync(file.fileno())


@contextmanager
def errors_of_writing(path: str | Path, error: type[Exception]) -> Iterator[None]:
    """Report an OSError in this block as an error of this type: the file cannot be written."""
    try:
        yield
    except OSError as reason:
        raise error(f"{path}: cannot be written ({reason.strerror or reason})") from None


@contextmanager
def replacement(target: Path) -> Iterator[Path]:
    """Yield an empty file next to `target` that replaces it when the block ends without an error.

    Args:
        target: The file itself, not a link to it.

    Raises:
        OSError: The file cannot be written or is being written to.

    """
    temporary = hidden_sibling(target)
    made: list[Path] = []
    try:
        made = make_folder(target.parent)
        temporary.open("xb").close()  # not tempfile: its files are readable by their owner only
        yield temporary
        with lock_folder(target.parent):
            check_is_free(target)
            temporary.replace(target)
        made = []
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        remove_folders(made)


def make_folder(folder: Path) -> list[Path]:
    """Make a folder and its parents, and return those that were missing, the innermost first."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    if missing:
        folder.mkdir(parents=True, exist_ok=True)
    return missing


def remove_folders(made: Iterable[Path]) -> None:
    """Remove folders that `make_folder` returned, as far as they are empty."""
    with suppress(OSError):
        for folder in made:
            folder.rmdir()


def hidden_sibling(target: Path) -> Path:
    """Return a hidden name in the same folder that no other file has."""
    return target.with_name(f".{target.stem[:100]}.{uuid4().hex[:8]}{target.suffix}")


def lock_for_writing(descriptor: int) -> None:
    """Mark an open file as being written to, until it is closed or its process ends."""
    if fcntl:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def check_is_free(target: Path) -> None:
    """Raise BeingWrittenError if another process or sink writes to the file."""
    if not fcntl:
        return
    try:
        descriptor = os.open(target, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:  # no such file, or none that can be read
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BeingWrittenError from None
    except OSError:  # a file system without locks
        return
    finally:
        os.close(descriptor)


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Lock a folder against other processes that replace files in it; after PATIENCE go on without the lock."""
    descriptor = -1
    if fcntl:
        with suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY)
    try:
        end = time.monotonic() + PATIENCE
        while descriptor >= 0 and time.monotonic() < end:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                time.sleep(0.005)
            except OSError:  # a file system without locks
                break
        yield
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def suffix_of(path: str | PurePath) -> str:
    """Return '.mcap' for 'run.mcap' and for 'RUN.MCAP', '' for a name without a suffix."""
    return PurePath(path).suffix.lower()


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a folder that is removed at the end, as far as the system lets it be.

    A signal that ends the process in order, as an exception, may come while the folder is removed; it is removed then
    all the same.
    """
    folder = Path(tempfile.mkdtemp(prefix="kinfmu_"))
    try:
        yield folder
    finally:
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
