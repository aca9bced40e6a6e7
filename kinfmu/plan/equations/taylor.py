"""Taylor numbers: a value with its derivatives, as terms of a power series, for the formulas of joints and laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinfmu.mechanism.quantities.arithmetic import atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

NO_LENGTH = 1e-100  # divides in place of a length of 0: the derivative of a point at rest is 0
NEAR = 1e-9  # of the largest break, of a period; an argument with a side that is closer to a break is at it
_FACTORIALS = (1.0, 1.0, 2.0, 6.0)


class Taylor:
    """A power series, cut off after its order, 1 to 3.

        x(t + s) = c_0 + c_1 s + c_2 s^2 + c_3 s^3,   c_k = x^(k) / k!

    The formulas of joints and laws run on these numbers: with velocities as first derivatives they give nu and gamma,
    with unit vectors a gradient. No formula is differentiated by hand, none by finite differences. Griewank and
    Walther, Evaluating Derivatives, chapter 13.

    c: floats, or arrays: the quantities of a motion at all its samples, or derivatives along n lines at once. Operands
    have the same order, or are plain numbers.

    The argument of a law may have a side: at a break of the law the piece on this side counts, so that the result is a
    limit. side: (n,) -1: below a break, 1: above it, 0: as for numbers; None: 0 for all. Sums, products and quotients
    by a number keep it.
    """

    __slots__ = ("c", "side")
    __array_ufunc__ = None  # so that an array on the left of an operator leaves it to this class

    def __init__(self, c: Sequence[Any], side: Any = None) -> None:
        self.c = c
        self.side = side

    @staticmethod
    def of(order: int, *derivatives: Any) -> Taylor:
        """Return the series of a value and its derivatives; those not given are 0."""
        c = list(derivatives) + [0.0] * (order + 1 - len(derivatives))
        for k in range(2, len(derivatives)):
            c[k] = c[k] / _FACTORIALS[k]
        return Taylor(c)

    def derivative(self, order: int) -> Any:
        """Return the derivative of an order, 0 (the value) to that of the series."""
        return self.c[order] if order < 2 else self.c[order] * _FACTORIALS[order]

    def __add__(self, other: Any) -> Taylor:
        if not isinstance(other, Taylor):
            return Taylor([self.c[0] + other, *self.c[1:]], self.side)
        side = other.side if self.side is None else self.side
        a, b = self.c, other.c
        if len(a) == len(b) == 2:  # Jacobians, most of the work of an assembly: without a loop
            return Taylor((a[0] + b[0], a[1] + b[1]), side)
        return Taylor([x + y for x, y in zip(a, b, strict=True)], side)

    def __neg__(self) -> Taylor:
        return Taylor([-a for a in self.c], _turned(self.side, -1.0))

    def __sub__(self, other: Any) -> Taylor:
        if not isinstance(other, Taylor):
            return Taylor([self.c[0] - other, *self.c[1:]], self.side)
        side = _turned(other.side, -1.0) if self.side is None else self.side
        a, b = self.c, other.c
        if len(a) == len(b) == 2:
            return Taylor((a[0] - b[0], a[1] - b[1]), side)
        return Taylor([x - y for x, y in zip(a, b, strict=True)], side)

    def __rsub__(self, other: Any) -> Taylor:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Taylor:
        a = self.c
        if not isinstance(other, Taylor):
            side = None if self.side is None else _turned(self.side, other)
            return Taylor((a[0] * other, a[1] * other) if len(a) == 2 else [x * other for x in a], side)
        b = other.c
        product = [a[0] * b[0], a[1] * b[0] + a[0] * b[1]]
        for k in range(2, len(a)):
            term = a[k] * b[0]
            for j in range(1, k + 1):
                term = term + a[k - j] * b[j]
            product.append(term)
        return Taylor(product, _turned(other.side, a[0]) if self.side is None else _turned(self.side, b[0]))

    def __truediv__(self, other: Any) -> Taylor:
        if not isinstance(other, Taylor):
            return Taylor([a / other for a in self.c], _turned(self.side, other))
        return Taylor(_quotient(self.c, other.c), _turned(self.side, other.c[0]))

    def __rtruediv__(self, other: Any) -> Taylor:
        return _lifted(other, self) / self

    __radd__ = __add__
    __rmul__ = __mul__


def _lifted(x: Any, like: Taylor) -> Taylor:
    return x if isinstance(x, Taylor) else Taylor.of(len(like.c) - 1, x)


def _turned(side: Any, factor: Any) -> Any:
    """Return the side of a product."""
    return None if side is None else side * np.sign(factor)


def _quotient(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    quotient: list[Any] = []
    for k, rest in enumerate(a):
        for j in range(k - 1, -1, -1):
            rest = rest - quotient[j] * b[k - j]
        quotient.append(rest / b[0])
    return quotient


def _chain(x: Taylor, h: Sequence[Any]) -> Taylor:
    """Return h(x) from the derivatives of h at the value of x, of as many orders as x has."""
    a = x.c
    terms = [h[0], h[1] * a[1]]
    if len(a) > 2:
        terms.append(0.5 * (h[2] * a[1] * a[1]) + h[1] * a[2])
    if len(a) > 3:
        terms.append(h[1] * a[3] + h[2] * a[1] * a[2] + h[3] * a[1] * a[1] * a[1] / 6.0)
    return Taylor(terms)


def _plain(x: Any) -> Any:
    """Return a scalar of numpy as a float, with which Python computes faster; arrays stay arrays."""
    return x if isinstance(x, np.ndarray) else float(x)


def _divisor(length: Any) -> Any:
    """Return a length to divide by, NO_LENGTH in place of 0."""
    return np.where(length == 0.0, NO_LENGTH, length) if isinstance(length, np.ndarray) else length or NO_LENGTH


@sin.register
def _(x: Taylor) -> Taylor:
    s, c = _plain(np.sin(x.c[0])), _plain(np.cos(x.c[0]))
    return _chain(x, (s, c, -s, -c))


@cos.register
def _(x: Taylor) -> Taylor:
    s, c = _plain(np.sin(x.c[0])), _plain(np.cos(x.c[0]))
    return _chain(x, (c, -s, -c, s))


@sqrt.register
def _(x: Taylor) -> Taylor:
    root = _plain(np.sqrt(x.c[0]))
    slopes = [0.5 / _divisor(root)]
    for k in range(1, len(x.c) - 1):
        slopes.append((2.0 - 4.0 * k) * slopes[0] * slopes[0] * slopes[-1])
    return _chain(x, (root, *slopes))


@floor.register
def _(x: Taylor) -> Taylor:
    return _lifted(_plain(np.floor(x.c[0] if x.side is None else x.c[0] + NEAR * x.side)), x)


@curve.register
def _(x: Taylor, data: CurveData, order: int = 0) -> Taylor:
    return _chain(x, [_curve(data, order + k, x.c[0], x.side) for k in range(len(x.c))])


def _curve(data: CurveData, order: int, x: Any, side: Any) -> Any:
    """Return a derivative of a piecewise function at every sample."""
    if not isinstance(x, np.ndarray):
        return curve_value(data, order, x)
    values = x.ravel().tolist()
    if side is None:
        return np.array([curve_value(data, order, value) for value in values]).reshape(x.shape)
    breaks, pieces = data
    near = NEAR * (max(map(abs, breaks), default=0.0) or 1.0)
    numbers = np.searchsorted(np.array(breaks), np.ravel(x + near * side), "right").tolist()
    of_pieces = [curve_value(((), (pieces[k],)), order, value) for k, value in zip(numbers, values, strict=True)]
    return np.array(of_pieces).reshape(x.shape)


@atan2_like.register
def _(like: Taylor, y: Any, x: Any) -> Taylor:
    """w' = (x y' - y x') / (x^2 + y^2)."""
    y, x = _lifted(y, like), _lifted(x, like)
    a, b, squared = x.c, y.c, list((x * x + y * y).c)
    squared[0] = _divisor(squared[0])
    turned = [
        sum((k - 2 * j) * (a[j] * b[k - j] - b[j] * a[k - j]) for j in range((k + 1) // 2)) for k in range(1, len(a))
    ]
    rates = [rate / k for k, rate in enumerate(_quotient(turned, squared), 1)]
    return Taylor([_plain(np.arctan2(b[0], a[0])), *rates])
