"""Kinds of arguments that are files: one to read, which must be there, and one to write, whose folder must be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from kinfmu.errors import listed, suggestion
from kinfmu.files.whole_file import suffix_of


class InputFile(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A file that is there; suffixes: how its name may end, in any way if there are none."""

    def __init__(self, *suffixes: str) -> None:
        self.suffixes = suffixes
        self.name = "FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if not exists(path):
            self.fail(missing(path), param, ctx)
        _check_suffix(self, path, self.suffixes, param, ctx)
        return path


class OutputFile(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A file to be written into a folder that is there; suffixes: how its name may end."""

    def __init__(self, *suffixes: str) -> None:
        self.suffixes = suffixes
        self.name = "FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        _check_suffix(self, path, self.suffixes, param, ctx)
        if is_folder(path):
            self.fail(f"{path}: is a folder; the name of a file is needed", param, ctx)
        if not is_folder(path.parent):
            self.fail(f"{path}: there is no folder '{path.parent}'", param, ctx)
        return path


def exists(path: Path) -> bool:
    """True if something other than a folder is there; a name that no file can have is not there."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """True if a folder is there; a name that no folder can have is not there."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def missing(path: Path) -> str:
    """'runn.csv: there is no such file; did you mean 'run.csv'?': of its folder, by names that end alike."""
    if is_folder(path):
        return f"{path}: is a folder; the name of a file is needed"
    return f"{path}: there is no such file{suggestion(str(path), beside(path, suffix_of(path)))}"


def beside(path: Path, suffix: str) -> list[str]:
    """Files of a suffix in the folder of a path, by how they would be given in its place."""
    try:
        return sorted(str(path.with_name(one.name)) for one in path.parent.iterdir() if suffix_of(one) == suffix)
    except (OSError, ValueError):  # no folder, or no name that a folder could have
        return []


def _check_suffix(
    kind: click.ParamType,  # type: ignore[type-arg,unused-ignore]
    path: Path,
    suffixes: Sequence[str],
    param: click.Parameter | None,
    ctx: click.Context | None,
) -> None:
    if suffixes and suffix_of(path) not in suffixes:
        ends = suffixes[0] if len(suffixes) == 1 else f"one of {listed(suffixes)}"
        kind.fail(f"{path}: its name must end in {ends}", param, ctx)
