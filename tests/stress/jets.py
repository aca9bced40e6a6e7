"""Jets: values with their first two derivatives in time, over arrays of numbers of more digits than doubles have.

The same lines of a closed form run on two kinds of numbers:

* LONG: numpy's long double, 64 bits on most machines with Linux: 2000 times finer than doubles, and quick;
* DIGITS: mpmath with the 50 digits of tests/oracle.py, element by element.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from tests.power_series import mp

Array = Any  # (n,) of long doubles or of mpmath numbers
Exact = Fraction | int  # lengths as they are written, in decimals


@dataclass(frozen=True)
class Numbers:
    """A kind of numbers: how to make them, and the functions that arithmetic does not give."""

    name: str
    array: Callable[[Any], Array]  # doubles as what they are
    number: Callable[[Exact], Any]
    pi: Any
    sqrt: Callable[[Array], Array]
    sin: Callable[[Array], Array]
    cos: Callable[[Array], Array]
    arctan2: Callable[[Array, Array], Array]

    def angle(self, direction: tuple[Exact, Exact]) -> Any:
        """The angle of a direction (x, y) given exactly."""
        x, y = (self.array([self.number(value)]) for value in direction)
        return self.arctan2(y, x)[0]


@lru_cache(maxsize=4096)
def _long(value: Exact) -> Any:
    value = Fraction(value)
    return np.longdouble(value.numerator) / np.longdouble(value.denominator)


def _digits(value: Exact) -> Any:
    value = Fraction(value)
    return mp.mpf(value.numerator) / value.denominator


def _each(function: Callable[..., Any], count: int) -> Callable[..., Array]:
    return np.frompyfunc(function, count, 1)


LONG = Numbers(
    "long double",
    lambda values: np.asarray(values, dtype=np.longdouble),
    _long,
    np.longdouble("3.14159265358979323846264338327950288"),
    np.sqrt,
    np.sin,
    np.cos,
    np.arctan2,
)
DIGITS = Numbers(
    "50 digits",
    lambda values: np.array([mp.mpf(value) for value in values], dtype=object),
    _digits,
    +mp.pi,
    _each(mp.sqrt, 1),
    _each(mp.sin, 1),
    _each(mp.cos, 1),
    _each(mp.atan2, 2),
)
SCREENING = LONG if np.finfo(np.longdouble).eps < 2e-19 else DIGITS  # long doubles are mere doubles on some machines


class Jet:
    """x, dx/dt, d2x/dt2 (n,) each."""

    __array_ufunc__ = None  # numpy's numbers leave arithmetic with a jet to the jet
    __slots__ = ("d0", "d1", "d2", "numbers")

    def __init__(self, numbers: Numbers, d0: Array, d1: Array, d2: Array) -> None:
        self.numbers, self.d0, self.d1, self.d2 = numbers, d0, d1, d2

    def _made(self, d0: Array, d1: Array, d2: Array) -> Jet:
        return Jet(self.numbers, d0, d1, d2)

    def __neg__(self) -> Jet:
        return self._made(-self.d0, -self.d1, -self.d2)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self._made(self.d0 + other.d0, self.d1 + other.d1, self.d2 + other.d2)
        return self._made(self.d0 + other, self.d1, self.d2)

    def __sub__(self, other: Any) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return self._made(self.d0 * other, self.d1 * other, self.d2 * other)
        cross = self.d1 * other.d1
        return self._made(
            self.d0 * other.d0,
            self.d0 * other.d1 + self.d1 * other.d0,
            self.d0 * other.d2 + cross + cross + self.d2 * other.d0,
        )

    def __truediv__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return self._made(self.d0 / other, self.d1 / other, self.d2 / other)
        d0 = self.d0 / other.d0
        d1 = (self.d1 - d0 * other.d1) / other.d0
        return self._made(d0, d1, (self.d2 - 2 * d1 * other.d1 - d0 * other.d2) / other.d0)

    __radd__ = __add__
    __rmul__ = __mul__

    def sqrt(self) -> Jet:
        """The positive root."""
        d0 = self.numbers.sqrt(self.d0)
        d1 = self.d1 / (2 * d0)
        return self._made(d0, d1, (self.d2 - 2 * d1 * d1) / (2 * d0))

    def sin_cos(self) -> tuple[Jet, Jet]:
        """Sine and cosine."""
        s, c = self.numbers.sin(self.d0), self.numbers.cos(self.d0)
        squared = self.d1 * self.d1
        return (
            self._made(s, c * self.d1, c * self.d2 - s * squared),
            self._made(c, -s * self.d1, -s * self.d2 - c * squared),
        )


class Value(Jet):
    """A jet without derivatives, for who looks at places alone."""

    __slots__ = ()

    def __init__(self, numbers: Numbers, d0: Array) -> None:
        super().__init__(numbers, d0, None, None)

    def __neg__(self) -> Value:
        return Value(self.numbers, -self.d0)

    def __add__(self, other: Any) -> Value:
        return Value(self.numbers, self.d0 + (other.d0 if isinstance(other, Jet) else other))

    def __mul__(self, other: Any) -> Value:
        return Value(self.numbers, self.d0 * (other.d0 if isinstance(other, Jet) else other))

    def __truediv__(self, other: Any) -> Value:
        return Value(self.numbers, self.d0 / (other.d0 if isinstance(other, Jet) else other))

    __radd__ = __add__
    __rmul__ = __mul__

    def sqrt(self) -> Value:
        """The positive root."""
        return Value(self.numbers, self.numbers.sqrt(self.d0))

    def sin_cos(self) -> tuple[Value, Value]:
        """Sine and cosine."""
        return Value(self.numbers, self.numbers.sin(self.d0)), Value(self.numbers, self.numbers.cos(self.d0))


def arctan2(y: Jet, x: Jet) -> Jet:
    """The angle of (x, y), a principal value."""
    if isinstance(x, Value):
        return Value(x.numbers, x.numbers.arctan2(y.d0, x.d0))
    squared = x.d0 * x.d0 + y.d0 * y.d0
    rate = (x.d0 * y.d1 - y.d0 * x.d1) / squared
    squared_rate = 2 * (x.d0 * x.d1 + y.d0 * y.d1)
    bend = (x.d0 * y.d2 - y.d0 * x.d2 - rate * squared_rate) / squared
    return Jet(x.numbers, x.numbers.arctan2(y.d0, x.d0), rate, bend)


@dataclass(frozen=True)
class Vector:
    """A point of the plane, or the way between two."""

    x: Any  # a Jet, or a number that stands still
    y: Any

    def __add__(self, other: Vector) -> Vector:
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y)

    def times(self, factor: Any) -> Vector:
        return Vector(factor * self.x, factor * self.y)

    def turned_left(self) -> Vector:
        """Turned by a quarter turn."""
        return Vector(-self.y, self.x)

    def squared(self) -> Any:
        """The scalar product with itself."""
        return self.x * self.x + self.y * self.y

    def heading(self) -> Jet:
        """Its angle, a principal value."""
        return arctan2(self.y, self.x)


def turned(phi: Jet, x: Any, y: Any = 0) -> Vector:
    """(x, y) of a frame at angle phi: (x cos phi - y sin phi, x sin phi + y cos phi)."""
    s, c = phi.sin_cos()
    return Vector(c * x - s * y, s * x + c * y)
