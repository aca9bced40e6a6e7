"""Jets: values at many samples with their first three derivatives along a motion, as terms of power series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.quantities.arithmetic import atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

ORDERS = range(4)  # 0 to 3: value, speed, acceleration, jerk
_FACTORIALS = (1.0, 1.0, 2.0, 6.0)
NEAR = 1e-9  # of the largest break, of a period; an argument with a side that is closer to a break is at it


@dataclass(frozen=True, slots=True, eq=False)
class Jet:
    """A power series in time, cut off after the third power, at n samples at once.

        x(t + s) = c_0 + c_1 s + c_2 s^2 + c_3 s^3,   c_k = x^(k) / k!

    Joints and laws compute with it as with numbers. Products and quotients are Cauchy's; functions follow from their
    differential equations: r^2 = x, s' = c x', c' = -s x'. Griewank and Walther, Evaluating Derivatives, chapter 13.

    The argument of a law may have a side: at a break of the law the piece on this side counts, so that the result is a
    limit. Sums, products and quotients by a number keep it.
    """

    __array_ufunc__ = None  # so that an array on the left of an operator leaves it to this class

    c: tuple[Any, Any, Any, Any]  # floats, or arrays (n,)
    side: Any = None  # (n,) -1: below a break, 1: above it, 0: as for numbers; None: 0 for all

    @staticmethod
    def of(value: Any, *derivatives: Any) -> Jet:
        """Return the jet of a value and its derivatives; those not given are 0."""
        given = (value, *derivatives, 0.0, 0.0, 0.0)[:4]
        return Jet(tuple(one / n for one, n in zip(given, _FACTORIALS, strict=True)))

    def derivative(self, order: int) -> Any:
        """Return the derivative of an order, 0 to 3."""
        return self.c[order] * _FACTORIALS[order]

    def __add__(self, other: Any) -> Jet:
        other = _lifted(other)
        side = other.side if self.side is None else self.side
        return Jet(tuple(a + b for a, b in zip(self.c, other.c, strict=True)), side)

    def __neg__(self) -> Jet:
        return Jet(tuple(-a for a in self.c), _turned(self.side, -1.0))

    def __sub__(self, other: Any) -> Jet:
        return self + -_lifted(other)

    def __rsub__(self, other: Any) -> Jet:
        return _lifted(other) + -self

    def __mul__(self, other: Any) -> Jet:
        other = _lifted(other)
        a, b = self.c, other.c
        side = _turned(other.side, a[0]) if self.side is None else _turned(self.side, b[0])
        return Jet(tuple(sum(a[j] * b[k - j] for j in range(k + 1)) for k in ORDERS), side)

    def __truediv__(self, other: Any) -> Jet:
        b = _lifted(other).c
        found: list[Any] = []
        for k in ORDERS:
            found.append((self.c[k] - sum(found[j] * b[k - j] for j in range(k))) / b[0])
        return Jet(tuple(found), _turned(self.side, b[0]))

    def __rtruediv__(self, other: Any) -> Jet:
        return _lifted(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


def _lifted(x: Any) -> Jet:
    return x if isinstance(x, Jet) else Jet.of(x)


def _turned(side: Any, factor: Any) -> Any:
    """Return the side of a product."""
    return None if side is None else side * np.sign(factor)


def _integral(start: Any, rate: list[Any]) -> Jet:
    """Return the jet with a value and the first three terms of its rate."""
    return Jet((start, rate[0], rate[1] / 2.0, rate[2] / 3.0))


def _sine_and_cosine(x: Jet) -> tuple[Jet, Jet]:
    s, c = [np.sin(x.c[0])], [np.cos(x.c[0])]
    for k in (1, 2, 3):
        s.append(sum(j * x.c[j] * c[k - j] for j in range(1, k + 1)) / k)
        c.append(-sum(j * x.c[j] * s[k - j] for j in range(1, k + 1)) / k)
    return Jet(tuple(s)), Jet(tuple(c))


@sin.register
def _(x: Jet) -> Jet:
    return _sine_and_cosine(x)[0]


@cos.register
def _(x: Jet) -> Jet:
    return _sine_and_cosine(x)[1]


@sqrt.register
def _(x: Jet) -> Jet:
    found: list[Any] = [np.sqrt(x.c[0])]
    for k in (1, 2, 3):
        found.append((x.c[k] - sum(found[j] * found[k - j] for j in range(1, k))) / (2.0 * found[0]))
    return Jet(tuple(found))


@floor.register
def _(x: Jet) -> Jet:
    return Jet.of(np.floor(x.c[0] if x.side is None else x.c[0] + NEAR * x.side))


@curve.register
def _(x: Jet, data: CurveData, order: int = 0) -> Jet:
    f, f1, f2, f3 = (_curve(data, order + k, x.c[0], x.side) for k in ORDERS)
    _, a, b, c = x.c
    return Jet((f, f1 * a, f1 * b + 0.5 * f2 * a * a, f1 * c + f2 * a * b + f3 * a * a * a / 6.0))


def _curve(data: CurveData, order: int, x: Any, side: Any) -> FloatArray:
    """Return a derivative of a piecewise function at every sample."""
    values = np.ravel(x).tolist()
    if side is None:
        return np.array([curve_value(data, order, value) for value in values]).reshape(np.shape(x))
    breaks, pieces = data
    near = NEAR * (max(map(abs, breaks), default=0.0) or 1.0)
    numbers = np.searchsorted(np.array(breaks), np.ravel(x + near * side), "right").tolist()
    found = [curve_value(((), (pieces[k],)), order, value) for k, value in zip(numbers, values, strict=True)]
    return np.array(found).reshape(np.shape(x))


@atan2_like.register
def _(like: Jet, y: Any, x: Any) -> Jet:  # noqa: ARG001
    """w' = (x y' - y x') / (x^2 + y^2)."""
    y, x = _lifted(y), _lifted(x)
    rates = [Jet((one.c[1], 2.0 * one.c[2], 3.0 * one.c[3], 0.0)) for one in (x, y)]
    turning = (x * rates[1] - y * rates[0]) / (x * x + y * y)
    return _integral(np.arctan2(y.c[0], x.c[0]), list(turning.c))
