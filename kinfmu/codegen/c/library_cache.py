"""Compiled libraries on disk: a private folder whose files are checked before they are used.

A library is stored as KEY-DIGEST.so: KEY identifies what was compiled, DIGEST is the SHA-256 of the file. A file that
does not match its name, or that another user could have written, is removed and compiled again.

The folder holds a gigabyte at most of libraries that were not used for a day.

Writing is atomic and synced: a process that is killed, or a full disk, leaves no library that is cut short. Processes
that store the same library at once replace each other's file; the content is the same, since the name holds its digest.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from kinfmu.errors import CompilerError

MOST_BYTES = 1 << 28  # of a library; a larger file is not one of ours
STALE = 3600.0  # [s] age from which an unfinished file belongs to a process that was killed
MOST_KEPT = 1 << 30  # bytes of all libraries; then those that were not used for a day are removed
UNUSED = 86400.0  # [s]

_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_OPEN = os.O_RDONLY
for _flag in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"):  # those that the system has
    _OPEN |= getattr(os, _flag, 0)


def find(key: str, suffix: str) -> Path | None:
    """Return the stored library of a key, checked, or None.

    Raise a CompilerError if the folder is not private.
    """
    with _private_folder() as folder:
        for path in _listed(folder, f"{key}-", suffix):
            if _is_intact(path, path.name.removeprefix(f"{key}-").removesuffix(suffix)):
                with suppress(OSError):
                    os.utime(path)  # so that those in use are kept
                return path
            with suppress(OSError):
                path.unlink()
    return None


def store(key: str, suffix: str, data: bytes) -> Path:
    """Write a library and return its path.

    Raise a CompilerError if the folder is not private or cannot be written.
    """
    with _private_folder() as folder:
        _remove_stale(folder)
        path = folder / f"{key}-{hashlib.sha256(data).hexdigest()}{suffix}"
        descriptor, name = tempfile.mkstemp(prefix=".", suffix=".part", dir=folder)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        _sync(folder)
        _remove_unused(folder)
    return path


def cache_folder() -> Path:
    """Return the folder of compiled libraries: KINFMU_CACHE, or one in the user's cache folder."""
    given = os.environ.get("KINFMU_CACHE")
    if given:
        return Path(given).absolute()
    try:
        home = Path.home()
    except RuntimeError:
        raise CompilerError("there is no home folder for compiled libraries; set KINFMU_CACHE to a folder") from None
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")) / "kinfmu" / "cache"
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "kinfmu"
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache").absolute() / "kinfmu"


@contextmanager
def _private_folder() -> Iterator[Path]:
    """Yield the folder, made private; turn errors of the system in it into a CompilerError."""
    folder = cache_folder()
    try:
        folder.mkdir(mode=stat.S_IRWXU, parents=True, exist_ok=True)
        if os.name != "nt":
            _make_private(folder)
        yield folder
    except OSError as error:
        why = error.strerror or str(error)
        raise CompilerError(
            f"compiled libraries cannot be kept in '{folder}': {why}; set KINFMU_CACHE to a folder that you can write"
        ) from None


def _make_private(folder: Path) -> None:
    """Close the folder to others; CompilerError if it is another user's or others can still write in it."""
    about = folder.stat()
    if about.st_uid != os.geteuid():
        raise CompilerError(
            f"compiled libraries are not loaded from '{folder}': it belongs to user {about.st_uid}, "
            f"this process to user {os.geteuid()}; set KINFMU_CACHE to a folder of your own"
        )
    if about.st_mode & _OTHERS:
        with suppress(OSError):  # a read-only file system is no reason to refuse a folder that others cannot write
            folder.chmod(about.st_mode & stat.S_IRWXU)
    if folder.stat().st_mode & _OTHERS_WRITE:
        raise CompilerError(
            f"compiled libraries are not loaded from '{folder}': others can write in it; "
            "set KINFMU_CACHE to a folder of your own"
        )


def _is_intact(path: Path, digest: str) -> bool:
    """Return whether a file is a regular one with this SHA-256 that only this user can write."""
    try:
        descriptor = os.open(path, _OPEN)
    except OSError:
        return False
    try:
        about = os.fstat(descriptor)
        if not stat.S_ISREG(about.st_mode) or about.st_size > MOST_BYTES:
            return False
        if os.name != "nt" and (about.st_uid != os.geteuid() or about.st_mode & _OTHERS_WRITE):
            return False
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == digest
    except OSError:
        return False
    finally:
        os.close(descriptor)


def _listed(folder: Path, start: str, end: str) -> list[Path]:
    """Return the files whose names start and end so, in order."""
    names = os.listdir(folder)  # noqa: PTH208  in a folder of thousands five times as fast as a pattern
    return [folder / name for name in sorted(names) if name.startswith(start) and name.endswith(end)]


@cache  # once in a process
def _remove_unused(folder: Path) -> None:
    """Remove libraries that were not used for a day, if all together are too large."""
    with suppress(OSError):
        found = [(path, path.lstat()) for path in folder.iterdir()]
        if sum(about.st_size for _, about in found) <= MOST_KEPT:
            return
        for path, about in found:
            if time.time() - about.st_mtime > UNUSED:
                with suppress(OSError):  # on Windows a loaded one stays
                    path.unlink()


def _remove_stale(folder: Path) -> None:
    """Remove unfinished files of killed processes."""
    for path in _listed(folder, ".", ".part"):
        with suppress(OSError):
            if time.time() - path.lstat().st_mtime > STALE:
                path.unlink()


def _sync(folder: Path) -> None:
    """Bring the folder's list of files to disk, where the system can."""
    if os.name != "nt":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
