"""Arguments that are files: one to read, which must exist, and one to write, whose folder must exist."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from kinfmu.errors import listed, suggestion
from kinfmu.files.whole_file import suffix_of


class InputFile(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """An existing file; suffixes: valid endings of its name; default: any."""

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
    """A file to write into an existing folder; suffixes: valid endings of its name."""

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
    """Return True for an existing path that is no folder; False for an invalid name."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """Return True for an existing folder; False for an invalid name."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def missing(path: Path) -> str:
    """Return 'runn.csv: there is no such file; did you mean 'run.csv'?', from names with the same ending."""
    if is_folder(path):
        return f"{path}: is a folder; the name of a file is needed"
    return f"{path}: there is no such file{suggestion(str(path), beside(path, suffix_of(path)))}"


def beside(path: Path, suffix: str) -> list[str]:
    """Return the files with this suffix in the folder of a path, as they would be written in its place."""
    try:
        return sorted(str(path.with_name(one.name)) for one in path.parent.iterdir() if suffix_of(one) == suffix)
    except (OSError, ValueError):  # no folder, or an invalid name
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
