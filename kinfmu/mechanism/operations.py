"""Dimensions, and the operations of expressions: on numbers of any arithmetic, and on their dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

from kinfmu.mechanism.quantities.arithmetic import Value, atan2, cos, sin, sqrt
from kinfmu.units import KINDS, Quantity

_ANGLES = {0: "an angle", -1: "an angular speed", -2: "an angular acceleration"}  # by the power of time
_LENGTHS = {0: "a length", -1: "a speed", -2: "an acceleration"}


class DimensionError(Exception):
    """Two quantities are incompatible; the message names them."""


@dataclass(frozen=True)
class Dimension:
    """Powers of length, time and mass; an angle is a pure number marked as an angle.

    Attributes:
        length: Power of length.
        time: Power of time.
        mass: Power of mass.
        is_angle: True if it contains radians.
        is_bare: True if a factor is a number without a unit, which may have the unit of its key ("3" as a length, also
            "3*a/b").
        is_known: False for a parameter without a unit, whose quantity is unknown, and for values computed from it.

    """

    length: Fraction = Fraction(0)
    time: Fraction = Fraction(0)
    mass: Fraction = Fraction(0)
    is_angle: bool = False
    is_bare: bool = False
    is_known: bool = True

    @classmethod
    def of(cls, quantity: Quantity) -> Dimension:
        """Return the dimension of a quantity."""
        powers = {"mass": 0, "length": 0, "angle": 0, "number": 0, "time": 0}
        if quantity.kind in KINDS:
            powers |= zip(("mass", "length", "time"), KINDS[quantity.kind].powers, strict=True)
        else:
            powers[quantity.kind] += 1
        powers[quantity.per] -= quantity.order
        length, time, mass = (Fraction(powers[key]) for key in ("length", "time", "mass"))
        return cls(length, time, mass, is_angle=quantity.kind == "angle")

    @property
    def powers(self) -> tuple[Fraction, Fraction, Fraction]:
        """Powers of mass, length and time."""
        return self.mass, self.length, self.time

    @property
    def _kinds(self) -> list[str]:
        """The quantities with a mass in them that have this dimension."""
        return [kind for kind, measured in KINDS.items() if tuple(map(Fraction, measured.powers)) == self.powers]

    @property
    def quantity(self) -> Quantity | None:
        """The quantity of this dimension; None if it is unknown or files have no unit for it."""
        if not self.is_known or self.is_open:
            return None
        if self.mass:
            return Quantity(self._kinds[0]) if self._kinds else None
        for kind in ("angle" if self.is_angle else "number", "length", "time"):
            for order in (0,) if kind in ("number", "time") else (0, 1, 2):
                same = Dimension.of(Quantity(kind, order))
                if same.powers == self.powers:
                    return Quantity(kind, order)
        return None

    @property
    def is_open(self) -> bool:
        """True for a bare number, which takes the unit of its key."""
        return self.is_known and self.is_bare and not self.is_angle and not any(self.powers)

    def fits(self, other: Dimension) -> bool:
        """Return False if the two are known to be different quantities."""
        if not (self.is_known and other.is_known) or self.is_open or other.is_open:
            return True
        return self.powers == other.powers

    def __str__(self) -> str:
        if not any(self.powers) and not self.is_angle:
            return "a number"
        if self.mass and self._kinds:
            return KINDS[self._kinds[0]].meaning
        if self.mass == 0 and self.length == 0 and self.is_angle and self.time in _ANGLES:
            return _ANGLES[int(self.time)]
        if self.mass == 0 and self.length == 1 and self.time in _LENGTHS:
            return _LENGTHS[int(self.time)]
        if self.mass == 0 and self.length == 0 and self.time == 1:
            return "a time"
        named = zip(self.powers, ("mass", "length", "time"), strict=True)
        return " ".join(name if power == 1 else f"{name}^{power}" for power, name in named if power != 0)


BARE = Dimension(is_bare=True)
NUMBER = Dimension()
ANGLE = Dimension(is_angle=True)
UNKNOWN = Dimension(is_known=False)


def sum_of(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of a + b and of a - b."""
    if not a.fits(b):
        raise DimensionError(f"{a} and {b} cannot be added")
    known = max(a, b, key=lambda d: 0 if d.is_open else 2 if d.is_known else 1)
    return replace(known, is_angle=a.is_angle or b.is_angle, is_bare=a.is_bare and b.is_bare)


def product_of(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of a * b."""
    powers = (a.length + b.length, a.time + b.time, a.mass + b.mass)
    return Dimension(*powers, a.is_angle or b.is_angle, a.is_bare or b.is_bare, a.is_known and b.is_known)


def quotient_of(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of a / b."""
    turned = replace(b, length=-b.length, time=-b.time, mass=-b.mass, is_angle=False)
    return replace(product_of(a, turned), is_angle=a.is_angle and not b.is_angle)


def power_of(a: Dimension, exponent: Fraction) -> Dimension:
    """Dimension of a ** exponent."""
    powers = {"length": a.length * exponent, "time": a.time * exponent, "mass": a.mass * exponent}
    return replace(a, **powers, is_angle=a.is_angle and exponent == 1)  # type: ignore[arg-type]


def ratio_of_angle(a: Dimension) -> Dimension:
    """Dimension of sin a, cos a and tan a."""
    if not a.fits(ANGLE):
        raise DimensionError(f"an angle is needed, not {a}")
    return NUMBER


def angle_of_ratio(a: Dimension) -> Dimension:
    """Dimension of asin a and acos a."""
    if not a.fits(NUMBER):
        raise DimensionError(f"a number is needed, not {a}")
    return ANGLE


def angle_of_pair(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of atan2(a, b)."""
    if not a.fits(b):
        raise DimensionError(f"two quantities of the same kind are needed, not {a} and {b}")
    return ANGLE


class ExpressionStep(NamedTuple):
    """One step of an expression in postfix order, and its position in the text."""

    operation: str  # "number", "name", or a key of OPERATIONS
    at: int
    value: Any = None  # of "number" the float in the units used inside, of "name" the name, of "power" the exponent
    unit: str = ""  # of a number, as written
    dimension: Dimension = BARE  # of a number

    @property
    def exponent(self) -> tuple[int, ...]:
        """The exponent of a power, which the operation takes after its operand; empty for others."""
        return (self.value,) if self.operation == "power" else ()


class Operation(NamedTuple):
    """An operation in any arithmetic and on dimensions."""

    arity: int
    value: Callable[..., Value]
    dimension: Callable[..., Dimension]


def _power(base: Value, exponent: int) -> Value:
    """Return base ** exponent, by products only, so that every arithmetic gives the same bits."""
    product = base
    for _ in range(abs(exponent) - 1):
        product = product * base
    return 1.0 if exponent == 0 else product if exponent > 0 else 1.0 / product


OPERATORS = {
    "+": Operation(2, lambda a, b: a + b, sum_of),
    "-": Operation(2, lambda a, b: a - b, sum_of),
    "*": Operation(2, lambda a, b: a * b, product_of),
    "/": Operation(2, lambda a, b: a / b, quotient_of),
    "sign": Operation(1, lambda a: -a, lambda a: a),
    "power": Operation(1, _power, lambda a, exponent: power_of(a, Fraction(exponent))),
}
CONSTANTS = {"pi": Operation(0, lambda: math.pi, lambda: BARE)}
FUNCTIONS = {
    "sin": Operation(1, sin, ratio_of_angle),
    "cos": Operation(1, cos, ratio_of_angle),
    "tan": Operation(1, lambda x: sin(x) / cos(x), ratio_of_angle),
    "sqrt": Operation(1, sqrt, lambda a: power_of(a, Fraction(1, 2))),
    "asin": Operation(1, lambda x: atan2(x, sqrt((1.0 - x) * (1.0 + x))), angle_of_ratio),
    "acos": Operation(1, lambda x: atan2(sqrt((1.0 - x) * (1.0 + x)), x), angle_of_ratio),
    "atan2": Operation(2, atan2, angle_of_pair),
}
OPERATIONS = {**OPERATORS, **CONSTANTS, **FUNCTIONS}
WORDS = (*FUNCTIONS, *CONSTANTS)  # reserved: no parameter can have these names
