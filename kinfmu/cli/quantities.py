"""Arguments that are numbers with units: times, driver values, ranges."""

from __future__ import annotations

import math

import click

from kinfmu.cli.arguments import ArgumentType
from kinfmu.cli.messages import note
from kinfmu.errors import listed
from kinfmu.units import ANGLES, Quantity, factors, in_turns, looks_like_degrees, spelled


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
