"""Units: what a number in a mechanism file may carry, and what every variable declares.

Lengths stay in the mechanism's own unit all the way through; angles are radians inside, and files may write degrees.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, NamedTuple


class Quantity(NamedTuple):
    """The kind of a number: what it measures and which derivative with respect to time it is."""

    kind: str  # "length", "angle", "time" or "number"
    order: int = 0  # 0 position, 1 speed, 2 acceleration


Length = Annotated[float, Quantity("length")]
Radians = Annotated[float, Quantity("angle")]  # inside; files may write degrees
Number = Annotated[float, Quantity("number")]

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3, "in": 0.0254, "ft": 0.3048}
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi}
SECONDS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
_PER_TIME = ("", "/s", "/s2")


def unit_of(quantity: Quantity, length_unit: str) -> str:
    """The unit a variable of this quantity declares, such as `rad/s` or `mm/s2`."""
    base = {"length": length_unit, "angle": "rad", "time": "s", "number": "1"}[quantity.kind]
    return base + _PER_TIME[quantity.order]


def factors(quantity: Quantity, length_unit: str) -> dict[str, float]:
    """Every unit that may be written for `quantity`, with its factor into the unit used inside."""
    if quantity.kind == "number":
        return {}
    base: dict[str, float]
    if quantity.kind == "length":
        base = {unit: metres / METRES[length_unit] for unit, metres in METRES.items()}
        base[length_unit] = 1.0
    else:
        base = ANGLES if quantity.kind == "angle" else SECONDS
    if quantity.order == 0:
        return dict(base)
    suffixes = {"s": 1.0, "min": 60.0} if quantity.order == 1 else {"s2": 1.0}
    written = {f"{unit}/{per}": factor / seconds for unit, factor in base.items() for per, seconds in suffixes.items()}
    if quantity == Quantity("angle", 1):
        written["rpm"] = 2.0 * math.pi / 60.0
    return written


def display_units(unit: str) -> dict[str, float]:
    """Display units of a declared unit with their factors (display value = factor * value), for FMI."""
    base, slash, per = unit.partition("/")
    if base == "rad":
        return {f"deg{slash}{per}": 180.0 / math.pi}
    if base == "m":
        return {f"mm{slash}{per}": 1e3}
    return {}


@cache
def every_unit(length_unit: str) -> dict[str, tuple[Quantity, float]]:
    """Every unit that may be written for any quantity, with that quantity and its factor into the unit used inside."""
    quantities = [Quantity(kind, order) for kind in ("length", "angle") for order in (0, 1, 2)]
    return {
        unit: (quantity, factor)
        for quantity in (*quantities, Quantity("time"))
        for unit, factor in factors(quantity, length_unit).items()
    }
