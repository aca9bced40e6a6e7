"""Display units: those in which people wrote a number, and in which reports and pictures show it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.expression import Expression
from kinfmu.units import Quantity, factors, unit_of


class DisplayUnit(NamedTuple):
    """A unit in which numbers are shown: shown number = number / factor."""

    unit: str = "1"
    factor: float = 1.0

    @property
    def suffix(self) -> str:
        """The unit after a number, ' deg'; '' of pure numbers."""
        return "" if self.unit == "1" else f" {self.unit}"


def display_unit(quantity: Quantity | None, length_unit: str, wanted: str = "") -> DisplayUnit:
    """Return a unit to show a quantity in.

    Args:
        quantity: The quantity; None: a pure number.
        length_unit: Unit of length of the mechanism.
        wanted: The unit. Default, and for units of other quantities: the unit used inside.

    """
    if quantity is None or quantity.kind == "number":
        return DisplayUnit()
    known = factors(quantity, length_unit)
    unit = wanted if wanted in known else unit_of(quantity, length_unit)
    return DisplayUnit(unit, known.get(unit, 1.0))


def written_unit(values: Iterable[object], length_unit: str) -> str:
    """Return the unit of the first value that is text with a unit, such as '20 deg'; '' if none is."""
    for value in values:
        if isinstance(value, str):
            try:
                literal = Expression(value, length_unit).literal
            except MechanismError:
                continue
            if literal is not None and literal.unit:
                return literal.unit
    return ""
