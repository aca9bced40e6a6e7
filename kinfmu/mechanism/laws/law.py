"""The contract of a law: u = f(x), in plain arithmetic; rate and acceleration follow."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cache, lru_cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, NamedTuple, get_type_hints

from kinfmu.errors import MechanismError
from kinfmu.mechanism.quantities.arithmetic import Value, sqrt
from kinfmu.solver.python.curve import CurveData, curve
from kinfmu.units import Quantity

RISE_STEPS = 8.0  # that a rise is seen in at least: the modified trapezoid has 8 parts
SAME = 1e-9  # of the largest value at the breaks and midway between them; smaller differences are rounding


class Jumps(NamedTuple):
    """Arguments at which a law jumps: those of one period, in any order, and the period; 0 if they do not repeat."""

    at: tuple[Value, ...] = ()
    period: Value = 0.0


@cache
def jumping_breaks(data: CurveData, order: int = 2) -> tuple[float, ...]:
    """Return the breaks of a curve at which its value or a derivative up to an order differs between the two sides."""
    breaks, pieces = data
    found = set()
    for one in range(order + 1):
        sides = [
            (curve(((), (before,)), one, x), curve(((), (after,)), one, x))
            for x, (before, after) in zip(breaks, pairwise(pieces), strict=True)
        ]
        between = [curve(data, one, 0.5 * (a + b)) for a, b in pairwise(breaks)]
        largest = max((abs(value) for value in (*between, *(value for side in sides for value in side))), default=0.0)
        found |= {x for x, (left, right) in zip(breaks, sides, strict=True) if abs(right - left) > SAME * largest}
    return tuple(sorted(found))


class LawQuantity(NamedTuple):
    """What a number of a law measures, in terms of the law's u and x."""

    of: str  # "led" like u, "argument" like x, "angle" or "number"
    order: int = 0  # ... per x^order
    is_positive: bool = False

    @lru_cache(maxsize=256)  # noqa: B019  there are few, and tables have thousands of numbers
    def quantity(self, led: str, argument: str) -> Quantity:
        """Return the quantity if u is of the kind `led` and x of the kind `argument` ('length', 'angle', 'time')."""
        kind = {"led": led, "argument": argument}.get(self.of, self.of)
        if self.order and kind == argument:  # radians per radian are a number
            return Quantity("number", self.order - 1, argument if self.order > 1 else "time")
        return Quantity(kind, self.order, argument if self.order else "time")


Led = Annotated[float, LawQuantity("led")]
LedRate = Annotated[float, LawQuantity("led", 1)]
Argument = Annotated[float, LawQuantity("argument")]
Duration = Annotated[float, LawQuantity("argument", is_positive=True)]
Phase = Annotated[float, LawQuantity("angle")]
Frequency = Annotated[float, LawQuantity("angle", 1)]

ConstantPath = tuple[str | int, ...]
TURN = 2.0 * math.pi  # [rad]
NEARLY = 1e-9  # of a turn; a period may miss a turn by this much, because of rounding in degrees


class Constant(NamedTuple):
    """A number of a law and what it measures."""

    value: Any  # a float; before the mechanism is resolved also text or an expression
    measures: LawQuantity


class Law(ABC):
    """How one quantity follows another: a driver's over time, a follower's over the angle of its cam.

        u = f(x)

    A leaf is a frozen dataclass; its fields are keys of the driver's or joint's table in a mechanism file, and their
    annotations define their values. Its constants become FMU parameters `<driver>.<name>`.
    """

    type: ClassVar[str]  # its name in mechanism files

    @abstractmethod
    def target(self, x: Value, **constants: Value) -> Value:
        """Return f(x), in plain arithmetic, with the constants given by name."""

    def breaks(self, order: int, /, **constants: Value) -> Jumps:  # noqa: ARG002  smooth laws have none
        """Return the arguments at which f or a derivative up to an order jumps, in any arithmetic."""
        return Jumps()

    def fewest_steps(self, x: Value, **constants: Value) -> Value:  # noqa: ARG002  it is smooth, as poses are
        """Return the number of steps that a path takes at least through the law up to x, in plain arithmetic.

        In one step of a path it changes by one at most, so that no part of the law stays unseen: see `RISE_STEPS`.
        """
        return 0.0

    def most_steps(self, **constants: Value) -> Value:  # noqa: ARG002
        """Return a bound of the slope of `fewest_steps`; within its inverse, x passes over nothing."""
        return 0.0

    def most_added(self, **constants: Value) -> Value:
        """Return a bound of the numbers that are added to x, such as where a period begins: x is rounded like these."""
        added = [constants[name] for name, number in self.constants().items() if number.measures[:2] == ("argument", 0)]
        return sum((sqrt(number * number) for number in added), start=0.0)

    def own_breaks(self, order: int = 2) -> Jumps:
        """Return the arguments at which f or a derivative up to an order jumps, with the law's own constants."""
        return self.breaks(order, **{name: constant.value for name, constant in self.constants().items()})

    def numbers(self) -> dict[ConstantPath, Constant]:
        """Return every number of the law, by its path in the law's table; here the fields that are numbers."""
        return {(key,): Constant(getattr(self, key), measured) for key, measured in number_fields(type(self)).items()}

    def with_numbers(self, values: Mapping[ConstantPath, Any]) -> Law:
        """Return the law with other values of some numbers."""
        return replace(self, **{str(path[0]): value for path, value in values.items()})  # type: ignore[type-var]

    def constants(self) -> dict[str, Constant]:
        """Return the numbers that stay symbolic until the law is evaluated, by name."""
        return {str(path[0]): constant for path, constant in self.numbers().items()}

    def at(self, x: Value) -> Value:
        """Return f(x) with the law's own constants."""
        return self.target(x, **{name: constant.value for name, constant in self.constants().items()})

    def check(self, where: str) -> None:
        """Raise a MechanismError for invalid numbers; `where` is the table in messages, such as '[drivers.crank]'."""
        for path, (value, measures) in self.numbers().items():
            if measures.is_positive and not value > 0.0:
                raise MechanismError(f"{where} {path[0]} = {float(value)!r} must be positive")

    @property
    def repeats(self) -> bool:
        """True if its table declares it periodic."""
        return False

    @property
    def period(self) -> float:
        """Distance after which f repeats, 0 if it does not or is constant."""
        return 0.0

    def zeros(self) -> Mapping[str, Value]:
        """Return descriptions and values of numbers that are 0 if f(x + 2 pi) is f(x), in any arithmetic."""
        return {}

    def why_not_periodic(self) -> str:
        """Return why f(x + 2 pi) is not f(x) for all x, for messages; '' if it is.

        For laws of an angle: the lift of a cam, the radius of a pitch curve.
        """
        return f"law '{self.type}' does not repeat"


@cache
def number_fields(cls: type[Law]) -> Mapping[str, LawQuantity]:
    """Return the fields of a law class that are numbers, with what they measure."""
    hints = get_type_hints(cls, include_extras=True)
    metadata = {key.name: getattr(hints[key.name], "__metadata__", ()) for key in fields(cls)}  # type: ignore[arg-type]
    return {key: found for key, entries in metadata.items() for found in entries if isinstance(found, LawQuantity)}


@lru_cache(maxsize=64)
def values_by_degree(law: Law) -> tuple[float, ...]:
    """Return the values of a law at all degrees of a turn; mechanisms that differ in their lengths share them."""
    constants = {name: constant.value for name, constant in law.constants().items()}
    return tuple(float(law.target(math.radians(degrees), **constants)) for degrees in range(360))
