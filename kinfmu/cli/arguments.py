"""Arguments: files, mechanisms, outputs; numbers with units: times, driver values, ranges."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from kinfmu.cli.group import note
from kinfmu.errors import listed, suggestion
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery
from kinfmu.units import ANGLES, Quantity, factors, in_turns, looks_like_degrees, spelled


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
    """An existing file; or_folder: or a folder."""

    def __init__(self, *suffixes: str, or_folder: bool = False) -> None:
        super().__init__(*suffixes)
        self.or_folder = or_folder

    def read(self, text: str) -> Path:
        if self.or_folder and Path(text).is_dir():
            return Path(text)
        path = existing(text)
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
            existing(text)
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


def existing(text: str) -> Path:
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


class Time(ArgumentType):
    """A time in seconds, or with its unit."""

    name = "TIME"

    def read(self, text: str) -> float:
        return _number(text, Quantity("time"))


class RangeArgument(ArgumentType):
    """A range A:B:X of numbers, with units where the quantity has units; last: "N" samples or "STEP"."""

    def __init__(self, quantity: Quantity, last: str, length_unit: str = "m") -> None:
        self.quantity = quantity
        self.last = last
        self.length_unit = length_unit
        self.name = f"A:B:{last}"

    def read(self, text: str) -> tuple[float, float, float]:
        from kinfmu.run import MOST_SAMPLES

        parts = text.split(":")
        if len(parts) != 3:
            of_driver = "0deg:360deg:361" if self.quantity.kind == "angle" else "0mm:50mm:101"
            example = of_driver if self.last == "N" else "0:1.5:0.01"
            raise ValueError(f"'{text}' must be {self.name}, such as {example}")
        third = Quantity("number") if self.last == "N" else self.quantity
        a, b, x = (
            _number(part, quantity, self.length_unit)
            for part, quantity in zip(parts, (self.quantity, self.quantity, third), strict=True)
        )
        if self.last == "N" and (x != int(x) or x < 1):
            raise ValueError(f"'{text}': N = {parts[2]} must be a whole number of samples")
        if self.last == "STEP" and (x <= 0.0 or b < a):
            raise ValueError(f"'{text}' must increase, with a positive step")
        if (x if self.last == "N" else (b - a) / x) > MOST_SAMPLES:
            raise ValueError(f"'{text}' asks for more than {MOST_SAMPLES} samples")
        return a, b, x


def on_axis(option: str, text: str, label: str, unit: str, extent: str = "") -> float:
    """Return a position on the axis of a run.

    Args:
        option: The option that gives it, for messages.
        text: The position, such as '45deg', '1.5' or '20mm'.
        label: The axis, for messages.
        unit: Its unit.
        extent: What the messages add to the label, such as the range of the run.

    Returns:
        The position [s, rad or the run's unit of length].

    Raises:
        click.UsageError: The text is invalid.

    """
    kind = "time" if unit == "s" else "angle" if unit in ANGLES else "length" if unit else "number"
    try:
        return driver_value(option, text, Quantity(kind), unit if kind == "length" else "m")
    except click.UsageError as error:
        raise click.UsageError(f"{error.message}; the run is over {label}{extent}") from None


def driver_value(option: str, text: str, quantity: Quantity, length_unit: str) -> float:
    """Return a driver value or a time, with a note on a bare angle that looks like degrees.

    Args:
        option: The option that gives it, for messages.
        text: The value, such as '45deg'.
        quantity: What it is a value of.
        length_unit: The unit of length of the result.

    Returns:
        The value [rad, length, s].

    Raises:
        click.UsageError: The text is invalid.

    """
    try:
        value = _number(text, quantity, length_unit)
    except ValueError as error:
        raise click.UsageError(f"{option} {text}: {error}") from None
    if quantity == Quantity("angle") and looks_like_degrees(value) and is_bare(text):
        note(f"{option} {text}: {text} rad, {in_turns(value)}; write {text}deg for degrees")
    return value


def is_bare(text: str) -> bool:
    """Return True for a number without a unit."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(text: str, quantity: Quantity, length_unit: str = "m") -> float:
    """Return '360deg' in radians, '1.5' unchanged, '1/3 mm' in the unit of length; a ValueError lists the units."""
    known = factors(quantity, length_unit)
    text = spelled(text)
    for unit in sorted(known, key=len, reverse=True):
        if text.endswith(unit) and text[: -len(unit)].strip():
            text, factor = text[: -len(unit)], known[unit]
            break
    else:
        factor = 1.0
    try:
        above, slash, below = text.partition("/")
        number = (float(above) / float(below) if slash else float(text)) * factor
    except (ValueError, ZeroDivisionError):
        raise ValueError(f"'{text}' is not a number{f' (units: {listed(known)})' if known else ''}") from None
    if not math.isfinite(number):
        raise ValueError(f"'{text}' is not a finite number")
    return number
