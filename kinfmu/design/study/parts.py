"""The parts of a study on disk: each written whole, so that a study that was ended goes on where it was."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from kinfmu.design.study.definition import Study
from kinfmu.errors import StudyError
from kinfmu.files import BeingWrittenError, check_is_free, errors_of_writing, lock_for_writing, make_folder, replacement

SUFFIX = ".parts"
_MANIFEST = "study.json"
_END, _END_SIZE = b"PK\5\6", 22  # record at the end of a .npz file


class PartsFolder:
    """The folder FILE.parts next to the results FILE while a study runs.

    Raises a StudyError if the folder belongs to another study, or a run in progress uses it.

    target: The file of the results. restart: Remove the parts of another study, or of an earlier run.
    """

    def __init__(self, target: Path, study: Study, *, restart: bool = False) -> None:
        self.target = target
        self.folder = folder_of(target)
        self._study = study
        self._manifest = self.folder / _MANIFEST
        self._lock: int | None = None
        with errors_of_writing(self.folder, StudyError):
            make_folder(self.folder)
            self._take(restart=restart)

    def _take(self, *, restart: bool) -> None:
        """Lock the folder and make it that of the study."""
        try:
            check_is_free(self._manifest)
        except BeingWrittenError:
            raise StudyError(
                f"{self.folder}: a study in progress writes there; wait for it, or choose another file with -o"
            ) from None
        own = {"fingerprint": self._study.fingerprint, **self._study.definition}
        found = _manifest_of(self.folder)
        if restart or found is None:
            for path in self.folder.glob("part-*"):
                path.unlink()
            write_synced(self._manifest, json.dumps(own, indent=1).encode())
        elif found.get("fingerprint") != own["fingerprint"]:
            raise StudyError(
                f"{self.folder} holds parts of another study{_difference(found, own)}; continue that one, choose "
                f"another file with -o, or remove them with --restart"
            )
        else:
            for path in self.folder.glob(".*"):  # what was being written when the study was killed
                path.unlink()
        self._lock = os.open(self._manifest, os.O_RDWR)
        lock_for_writing(self._lock)

    def __enter__(self) -> PartsFolder:
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def path(self, first: int) -> Path:
        """Return the file of the part that begins with a design."""
        return self.folder / f"part-{first:010}.npz"

    def missing(self) -> list[int]:
        """Return the first designs of the parts that are still to be done."""
        return [first for first in self._study.parts if not _is_whole(self.path(first))]

    def write(self, first: int, data: bytes) -> None:
        """Write a part."""
        with errors_of_writing(self.path(first), StudyError):
            write_synced(self.path(first), data)

    def remove(self) -> None:
        """Remove the folder, after the results are written."""
        self.__exit__()
        shutil.rmtree(self.folder, ignore_errors=True)


def _manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest of a folder of parts, empty if it cannot be read; None without manifest and parts."""
    try:
        manifest = json.loads((folder / _MANIFEST).read_bytes())
    except (OSError, ValueError):
        return {} if any(folder.glob("part-*")) else None
    return manifest if isinstance(manifest, dict) else {}


def _is_whole(path: Path) -> bool:
    """Return True for a part that is there, up to the record at its end."""
    try:
        with path.open("rb") as file:
            file.seek(-_END_SIZE, os.SEEK_END)
            return file.read().startswith(_END)
    except OSError:
        return False


def check_replaceable(target: Path, study: Study, there: Mapping[str, str]) -> None:
    """Raise a StudyError for a file in the place of the results that is not of this study.

    A study that has parts may replace it: it was begun with restart.

    target: The file of the results. there: Metadata of the study whose results the file holds; empty for other files.
    """
    if not target.is_file() or _has_parts_of(study, target):
        return
    what = "is not the results of a study"
    if "study" in there:
        own = {"fingerprint": study.fingerprint, **study.definition}
        what = f"holds the results of another study{_difference(json.loads(there['study']), own)}"
    raise StudyError(f"{target} {what}; choose another file with -o, or replace it with --restart")


def remove_finished(target: Path, study: Study) -> None:
    """Remove the parts of a study whose results are written, if it was killed before it removed them."""
    if _has_parts_of(study, target):
        shutil.rmtree(folder_of(target), ignore_errors=True)


def _has_parts_of(study: Study, target: Path) -> bool:
    """Return True if the folder next to the results is that of this study."""
    return (_manifest_of(folder_of(target)) or {}).get("fingerprint") == study.fingerprint


def folder_of(target: Path) -> Path:
    """Return the folder of the parts of a file of results."""
    return target.with_name(target.name + SUFFIX)


def write_synced(path: Path, data: bytes) -> None:
    """Write a file whole, and on the disk before it gets its name."""
    with replacement(path) as temporary, temporary.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _difference(found: dict[str, Any], own: dict[str, Any]) -> str:
    """Return in what two studies differ, as far as their definitions say."""
    differing = [key for key in own if key != "fingerprint" and found.get(key) != own[key]]
    if not differing:
        return " (the mechanism or the version of kinfmu differs)"
    with suppress(KeyError):
        return f" ({differing[0]}: {_short(found[differing[0]])} there, {_short(own[differing[0]])} here)"
    return f" ({differing[0]} differs)"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
