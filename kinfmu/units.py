"""Units: what a number in a mechanism file may carry, and what every variable declares. Names of variables.

Lengths keep the mechanism's unit everywhere; angles are radians inside, and files may use degrees. Variables are named
`<body>.x .y .phi`, their rates `.vx .vy .omega`, their accelerations `.ax .ay .alpha`; points likewise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Annotated, NamedTuple


class Quantity(NamedTuple):
    """The kind of a number: what it measures and which derivative it is; default: of order 0, with respect to time."""

    kind: str  # "length", "angle", "time" or "number"
    order: int = 0  # 0 position, 1 speed, 2 acceleration
    per: str = "time"  # or "angle", "length": the variable of the derivative


Length = Annotated[float, Quantity("length")]
Radians = Annotated[float, Quantity("angle")]  # inside; files may write degrees
Number = Annotated[float, Quantity("number")]

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3, "in": 0.0254, "ft": 0.3048}
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi}
SECONDS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
HIGHEST_ORDER = 7  # of a derivative with a unit


def looks_like_degrees(angle: float) -> bool:
    """Return True for an angle [rad] that is probably in degrees: 30, 45, 60, 75, ..., of either sign."""
    return abs(angle) >= 30.0 and angle % 15.0 == 0.0


def in_turns(angle: float) -> str:
    """Return an angle [rad] in turns, for messages: '57.3 turns' for 360 rad."""
    return f"{abs(angle) / ANGLES['rev']:.3g} turns"


def unit_of(quantity: Quantity, length_unit: str) -> str:
    """Return the unit that a variable of this quantity declares, such as `rad/s` or `mm/s2`."""
    units = {"length": length_unit, "angle": "rad", "time": "s", "number": "1"}
    per = f"/{_power(units[quantity.per], quantity.order)}" if quantity.order else ""
    return units[quantity.kind] + per


def quantity_in(unit: str, length_unit: str) -> Quantity:
    """Return the quantity of a declared unit, the inverse of `unit_of`; an unknown unit gives a number."""
    known = every_unit(length_unit)
    return known[unit][0] if unit in known else Quantity("number")


def _power(unit: str, order: int) -> str:
    """Return 's' or 's2'."""
    return unit if order == 1 else f"{unit}{order}"


def _bases(kind: str, length_unit: str) -> dict[str, float]:
    """Return the units of a length, an angle or a time with their factors into the unit used inside."""
    if kind != "length":
        return ANGLES if kind == "angle" else SECONDS
    return {unit: metres / METRES[length_unit] for unit, metres in METRES.items()} | {length_unit: 1.0}


def factors(quantity: Quantity, length_unit: str) -> dict[str, float]:
    """Return every unit that files accept for `quantity`, with its factor into the unit used inside."""
    if quantity.kind == "number" or quantity.order > HIGHEST_ORDER:
        return {}
    base = _bases(quantity.kind, length_unit)
    if quantity.order == 0:
        return dict(base)
    below = _bases(quantity.per, length_unit)
    if quantity.per == "time":
        below = {"s": 1.0, "min": 60.0} if quantity.order == 1 else {"s": 1.0}
    written = {
        f"{unit}/{_power(per, quantity.order)}": factor / size**quantity.order
        for unit, factor in base.items()
        for per, size in below.items()
    }
    if quantity == Quantity("angle", 1):
        written |= {"rpm": 2.0 * math.pi / 60.0, "Hz": 2.0 * math.pi}
    return written


def display_units(unit: str) -> dict[str, float]:
    """Return the display units of a declared unit with their factors (display value = factor * value), for FMI."""
    base, slash, per = unit.partition("/")
    if base == "rad":
        return {f"deg{slash}{per}": 180.0 / math.pi}
    if base == "m":
        return {f"mm{slash}{per}": 1e3}
    return {}


@cache
def every_unit(length_unit: str) -> dict[str, tuple[Quantity, float]]:
    """Return every unit that files accept, with its quantity and its factor into the unit used inside."""
    pairs = (("length", "time"), ("angle", "time"), ("length", "angle"), ("angle", "length"))
    rates = [Quantity(kind, order, per) for kind, per in pairs for order in range(1, HIGHEST_ORDER + 1)]
    return {
        unit: (quantity, factor)
        for quantity in (Quantity("length"), Quantity("angle"), Quantity("time"), *rates)
        for unit, factor in factors(quantity, length_unit).items()
    }


_DERIVATIVES = {"x": ("x", "vx", "ax"), "y": ("y", "vy", "ay"), "phi": ("phi", "omega", "alpha")}


class CoordinateName(str):
    """The name of a coordinate, such as 'coupler.x', with the facts that it states.

    It is made from these facts, so that no code reads them from the text again. It is a `str` since columns, FMU
    variables and symbols of formulas go by this name.

    Args:
        owner: The body or the point of interest.
        axis: 'x', 'y' or 'phi'.

    Attributes:
        owner: As given.
        axis: As given.
        is_angle: True for an angle [rad], False for a length.

    """

    __slots__ = ("axis", "is_angle", "owner")
    owner: str
    axis: str
    is_angle: bool

    def __new__(cls, owner: str, axis: str) -> CoordinateName:
        name = super().__new__(cls, f"{owner}.{axis}")
        name.owner, name.axis, name.is_angle = owner, axis, axis == "phi"
        return name

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]  # for copies: what `__new__` takes
        return self.owner, self.axis

    def quantity(self, order: int = 0, per: str = "time") -> Quantity:
        """Return the quantity of the coordinate, or of its derivative of an order."""
        return Quantity("angle" if self.is_angle else "length", order, per)

    def derivative(self, order: int) -> str:
        """Return 'coupler.vx' for 'coupler.x' and order 1; order 0 gives the name itself."""
        return f"{self.owner}.{_DERIVATIVES[self.axis][order]}" if order else self


class InputName(str):
    """The name of an input, such as 'crank_angle' or 'crank_speed', with the facts that it states.

    Args:
        driver: The driver.
        noun: What the driver drives: 'angle', 'position' or 'length'.
        order: 0 for the value, 1 for its speed, 2 for its acceleration.

    Attributes:
        driver: As given.
        noun: As given.
        quantity: The quantity of the input.

    """

    __slots__ = ("driver", "noun", "quantity")
    driver: str
    noun: str
    quantity: Quantity

    def __new__(cls, driver: str, noun: str, order: int = 0) -> InputName:
        name = super().__new__(cls, f"{driver}_{(noun, 'speed', 'acceleration')[order]}")
        name.driver, name.noun = driver, noun
        name.quantity = Quantity("angle" if noun == "angle" else "length", order)
        return name

    def __getnewargs__(self) -> tuple[str, str, int]:  # type: ignore[override]  # for copies: what `__new__` takes
        return self.driver, self.noun, self.quantity.order

    def derivative(self, order: int) -> InputName:
        """Return the input of the same driver for its value, speed or acceleration."""
        return InputName(self.driver, self.noun, order)


VariableName = CoordinateName | InputName  # what has a derivative with a name of its own


def read_coordinate(text: str) -> CoordinateName | None:
    """Return the coordinate that a name in a file states; None if the text is no such name."""
    owner, _, axis = text.rpartition(".")
    return CoordinateName(owner, axis) if owner and axis in _DERIVATIVES else None


def read_inputs(texts: Sequence[str]) -> tuple[InputName, ...] | None:
    """Return the inputs that names in a file state, three for each driver; None if the texts are no such names."""
    inputs: list[InputName] = []
    for value in texts[::3]:
        driver, _, noun = value.rpartition("_")
        if not driver or noun not in ("angle", "position", "length"):
            return None
        inputs += [InputName(driver, noun, order) for order in range(3)]
    return tuple(inputs) if inputs == list(texts) else None
