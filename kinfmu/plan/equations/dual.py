"""Dual numbers: a value with its gradient, for Jacobians of the joints' own formulas."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinfmu.mechanism.quantities.arithmetic import atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

NO_LENGTH = 1e-100  # divides in place of a length of 0: the derivative of a point at rest is 0


class Dual:
    """A value f with its gradient over n coordinates, g: (n,), or 0.0 for a constant.

        (f h)' = f' h + f h',   h(f)' = h'(f) f'

    The first order of `Taylor`, to the bit, at a third of its time: Jacobians are most of the work of an assembly.
    """

    __slots__ = ("f", "g")
    __array_ufunc__ = None  # so that an array on the left of an operator leaves it to this class

    def __init__(self, f: float, g: Any = 0.0) -> None:
        self.f = f
        self.g = g

    def __add__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.f + other.f, self.g + other.g)
        return Dual(self.f + other, self.g)

    def __neg__(self) -> Dual:
        return Dual(-self.f, -self.g)

    def __sub__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.f - other.f, self.g - other.g)
        return Dual(self.f - other, self.g)

    def __rsub__(self, other: float) -> Dual:
        return Dual(other - self.f, -self.g)

    def __mul__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.f * other.f, self.g * other.f + self.f * other.g)
        return Dual(self.f * other, self.g * other)

    def __truediv__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            quotient = self.f / other.f
            return Dual(quotient, (self.g - quotient * other.g) / other.f)
        return Dual(self.f / other, self.g / other)

    def __rtruediv__(self, other: float) -> Dual:
        return Dual(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


@sin.register
def _(x: Dual) -> Dual:
    return Dual(float(np.sin(x.f)), float(np.cos(x.f)) * x.g)


@cos.register
def _(x: Dual) -> Dual:
    return Dual(float(np.cos(x.f)), -float(np.sin(x.f)) * x.g)


@sqrt.register
def _(x: Dual) -> Dual:
    root = float(np.sqrt(x.f))
    return Dual(root, 0.5 / (root or NO_LENGTH) * x.g)


@floor.register
def _(x: Dual) -> Dual:
    return Dual(float(np.floor(x.f)))


@curve.register
def _(x: Dual, data: CurveData, order: int = 0) -> Dual:
    return Dual(curve_value(data, order, x.f), curve_value(data, order + 1, x.f) * x.g)


@atan2_like.register
def _(like: Dual, y: Dual | float, x: Dual | float) -> Dual:  # noqa: ARG001
    """g = (x y' - y x') / r^2."""
    y, x = (value if isinstance(value, Dual) else Dual(value) for value in (y, x))
    squared = x.f * x.f + y.f * y.f or NO_LENGTH
    return Dual(float(np.arctan2(y.f, x.f)), (x.f * y.g - y.f * x.g) / squared)
