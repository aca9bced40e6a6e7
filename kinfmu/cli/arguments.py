"""Kinds of arguments: a mechanism, NAME=VALUE, and ranges of numbers with units."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu import gallery
from kinfmu.cli.files import beside, exists, missing
from kinfmu.cli.messages import note
from kinfmu.errors import listed, suggestion
from kinfmu.files.whole_file import suffix_of
from kinfmu.units import ANGLES, Quantity, factors, in_turns, looks_like_degrees

if TYPE_CHECKING:
    from kinfmu.run import Run


class MechanismName(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A gallery name or a .toml file. A missing file is wrong usage; commands report errors in it."""

    name = "MECH"
    suffixes = ".toml"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        name, known = str(value), gallery.names()
        if suffix_of(name) == ".toml":
            return name if exists(Path(name)) else self.fail(missing(Path(name)), param, ctx)
        files = (f"{name}.toml", str(Path(name) / "mechanism.toml"))
        if gallery.has(name):
            if exists(Path(files[0])):
                note(f"{name} is the gallery's; the file in this folder is {files[0]}")
            return name
        near = next((f"; did you mean '{file}'?" for file in files if exists(Path(file))), "")
        near = near or suggestion(name, [*beside(Path(name), ".toml"), *known])
        message = f"'{name}' is not in the gallery{near}; gallery: {listed(known)}; files end in {self.suffixes}"
        return self.fail(message, param, ctx)


class ModelName(MechanismName):
    """An .fmu file, or a mechanism."""

    name = "FMU|MECH"
    suffixes = ".toml or .fmu"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if suffix_of(str(value)) == ".fmu":
            return str(value) if exists(Path(value)) else self.fail(missing(Path(value)), param, ctx)
        return super().convert(value, param, ctx)


class Setting(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """NAME=VALUE."""

    name = "NAME=VALUE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        if isinstance(value, tuple):
            return value
        name, equals, text = str(value).partition("=")
        if not (name and equals and text):
            self.fail(f"'{value}' must be NAME=VALUE, such as crank.speed=30rpm", param, ctx)
        return name, text


class Range(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A range A:B:X of numbers, with units where the quantity has units."""

    def __init__(self, quantity: Quantity, last: str, length_unit: str = "m") -> None:
        self.quantity = quantity
        self.last = last
        self.length_unit = length_unit
        self.name = f"A:B:{last}"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, float]:
        if isinstance(value, tuple):
            return value
        parts = str(value).split(":")
        if len(parts) != 3:
            of_driver = "0deg:360deg:361" if self.quantity.kind == "angle" else "0mm:50mm:101"
            example = of_driver if self.last == "N" else "0:1.5:0.01"
            self.fail(f"'{value}' must be {self.name}, such as {example}", param, ctx)
        third = Quantity("number") if self.last == "N" else self.quantity
        try:
            numbers = [
                _number(part, quantity, self.length_unit)
                for part, quantity in zip(parts, (self.quantity, self.quantity, third), strict=True)
            ]
        except ValueError as error:
            return self.fail(str(error), param, ctx)
        a, b, x = numbers
        if self.last == "N" and (x != int(x) or x < 1):
            self.fail(f"'{value}': N = {parts[2]} must be a whole number of samples", param, ctx)
        if self.last == "STEP" and (x <= 0.0 or b < a):
            self.fail(f"'{value}' must increase, with a positive step", param, ctx)
        from kinfmu.run import MOST_SAMPLES

        if (x if self.last == "N" else (b - a) / x) > MOST_SAMPLES:
            self.fail(f"'{value}' asks for more than {MOST_SAMPLES} samples", param, ctx)
        return a, b, x


class Time(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A time in seconds, or with its unit."""

    name = "TIME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        try:
            return _number(str(value), Quantity("time"))
        except ValueError as error:
            return self.fail(str(error), param, ctx)


def along(text: str | None, option: str, run: Run) -> float | None:
    """Return a position on the axis of a run [s, rad or the run's unit of length]; UsageError for invalid text."""
    if text is None:
        return None
    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    return on_axis(text, option, axis.label, axis.unit, f", {axis.range()}")


def on_axis(text: str, option: str, label: str, unit: str, extent: str = "") -> float:
    """Return a position on an axis [s, rad or its unit of length]; raise a UsageError for invalid text.

    label, unit: of the axis; extent: what the message adds to the label, such as the range of the run.
    """
    kind = "time" if unit == "s" else "angle" if unit in ANGLES else "length" if unit else "number"
    try:
        return driver_value(option, text, Quantity(kind), unit if kind == "length" else "m")
    except click.UsageError as error:
        raise click.UsageError(f"{error.message}; the run is over {label}{extent}") from None


def driver_value(option: str, text: str, quantity: Quantity, length_unit: str) -> float:
    """Return a driver value or a time [rad, length, s]; raise a UsageError for invalid text."""
    try:
        value = _number(text, quantity, length_unit)
    except ValueError as error:
        raise click.UsageError(f"{option} {text}: {error}") from None
    if quantity.kind == "angle" and looks_like_degrees(value) and is_bare(text):
        note(f"{option} {text}: {text} rad, {in_turns(value)}; write {text}deg for degrees")
    return value


def is_bare(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def names_in(text: str | None) -> list[str] | None:
    """Return names separated by commas; None for no text."""
    return [name.strip() for name in text.split(",")] if text else None


def _number(text: str, quantity: Quantity, length_unit: str = "m") -> float:
    """Return '360deg' in radians, '1.5' unchanged, '3mm' in the unit of length; a ValueError lists the valid units."""
    known = factors(quantity, length_unit)
    for unit in sorted(known, key=len, reverse=True):
        if text.endswith(unit) and text[: -len(unit)].strip():
            text, factor = text[: -len(unit)], known[unit]
            break
    else:
        factor = 1.0
    try:
        number = float(text) * factor
    except ValueError:
        raise ValueError(f"'{text}' is not a number{f' (units: {listed(known)})' if known else ''}") from None
    if not math.isfinite(number):
        raise ValueError(f"'{text}' is not a finite number")
    return number


OUTPUTS_HELP = "Only these outputs with their rates, such as coupler.x,rocker.phi"
MECHANISM = MechanismName()
MODEL = ModelName()
SETTING = Setting()
TIME = Time()
set_option = click.option(
    "--set",
    "settings",
    type=SETTING,
    multiple=True,
    help="Set a parameter or a law's constant, such as crank=40mm or crank.speed=30rpm. Repeat for several.",
)
