"""Arguments that name something: files to read or write, a mechanism, outputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from kinfmu.cli.messages import note
from kinfmu.errors import listed, suggestion
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery


class ArgumentType(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A kind of argument; `read` returns the value of a text, and its ValueErrors are reported as wrong usage."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the value; click also passes values that are converted already."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except ValueError as error:
            return self.fail(str(error), param, ctx)

    def read(self, text: str) -> Any:
        """Return the value of a text; a ValueError states what would be valid."""
        raise NotImplementedError


class _File(ArgumentType):
    """The name of a file; suffixes: its valid endings; default: any."""

    name = "FILE"

    def __init__(self, *suffixes: str) -> None:
        self.suffixes = suffixes

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Let the shell complete names of files."""
        return [CompletionItem(incomplete, type="file")]


class InputFile(_File):
    """An existing file."""

    def read(self, text: str) -> Path:
        path = _existing(text)
        _check_suffix(path, self.suffixes)
        return path


STANDARD_OUTPUT = Path("-")


class OutputFile(_File):
    """A file to write; missing folders are made with it; or_standard_output: '-' is STANDARD_OUTPUT."""

    def __init__(self, *suffixes: str, or_standard_output: bool = False) -> None:
        super().__init__(*suffixes)
        self.or_standard_output = or_standard_output

    def read(self, text: str) -> Path:
        path = Path(text)
        if self.or_standard_output and path == STANDARD_OUTPUT:
            return path
        _check_suffix(path, self.suffixes)
        if _is_folder(path):
            raise ValueError(f"{path}: is a folder; the name of a file is needed")
        in_the_way = next((one for one in path.parents if exists(one)), None)
        if in_the_way is not None:
            raise ValueError(f"{path}: '{in_the_way}' is a file, not a folder")
        return path


class MechanismName(ArgumentType):
    """A gallery name or a .toml file. A missing file is wrong usage; commands report errors in it."""

    name = "MECH"
    suffixes: tuple[str, ...] = (".toml",)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Return the names of the gallery that begin so; the shell completes names of files."""
        names = [CompletionItem(name) for name in gallery.names() if incomplete and name.startswith(incomplete)]
        return names or [CompletionItem(incomplete, type="file")]

    def read(self, text: str) -> str:
        if suffix_of(text) in self.suffixes:
            _existing(text)
            return text
        known = gallery.names()
        files = (f"{text}.toml", str(Path(text) / "mechanism.toml"))
        if gallery.has(text):
            if exists(Path(files[0])):
                note(f"{text} is the gallery's; the file in this folder is {files[0]}")
            return text
        if exists(Path(text)):
            raise ValueError(f"{text}: its name must end in {' or '.join(self.suffixes)}; or name one of the gallery")
        near = next((f"; did you mean '{file}'?" for file in files if exists(Path(file))), "")
        near = near or suggestion(text, [*_neighbours(Path(text), ".toml"), *known])
        endings = " or ".join(self.suffixes)
        raise ValueError(f"'{text}' is not in the gallery{near}; gallery: {listed(known)}; files end in {endings}")


class ModelName(MechanismName):
    """An .fmu or .ssp file, or a mechanism."""

    name = "FMU|SSP|MECH"
    suffixes = (".toml", ".fmu", ".ssp")


class RecordOrMechanism(MechanismName):
    """A record (.mcap), or a mechanism."""

    name = "RUN|MECH"
    suffixes = (".toml", ".mcap")


mechanism_argument = click.argument("mechanism", type=MechanismName(), metavar="MECH")
outputs_option = click.option(
    "--outputs",
    metavar="NAMES",
    help="Only these outputs with their rates, such as coupler.x,rocker.phi; only what they need is solved.",
)


def names_in(text: str | None) -> list[str] | None:
    """Return names separated by commas; None for no text."""
    return [name.strip() for name in text.split(",")] if text else None


def exists(path: Path) -> bool:
    """Return True for an existing path that is no folder; False for an invalid name."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


def _is_folder(path: Path) -> bool:
    """Return True for an existing folder; False for an invalid name."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _existing(text: str) -> Path:
    """Return the path of a file; the ValueError for a missing one suggests a name with the same ending."""
    path = Path(text)
    if _is_folder(path):
        raise ValueError(f"{path}: is a folder; the name of a file is needed")
    if not exists(path):
        raise ValueError(f"{path}: there is no such file{suggestion(str(path), _neighbours(path, suffix_of(path)))}")
    return path


def _neighbours(path: Path, suffix: str) -> list[str]:
    """Return the files with this suffix in the folder of a path, as they would be written in its place."""
    try:
        return sorted(str(path.with_name(one.name)) for one in path.parent.iterdir() if suffix_of(one) == suffix)
    except (OSError, ValueError):  # no folder, or an invalid name
        return []


def _check_suffix(path: Path, suffixes: tuple[str, ...]) -> None:
    if suffixes and suffix_of(path) not in suffixes:
        ends = suffixes[0] if len(suffixes) == 1 else f"one of {listed(suffixes)}"
        raise ValueError(f"{path}: its name must end in {ends}")
