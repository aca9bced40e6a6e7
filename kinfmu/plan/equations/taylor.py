"""Taylor numbers: a value with its first and second derivative along a line, for the readable reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.mechanism.quantities.arithmetic import atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.plan.equations.dual import NO_LENGTH
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

Derivative = Any  # float, or (n,) for n lines at once


@dataclass(frozen=True, slots=True, eq=False)
class Taylor:
    """f, f' and f'' along one line or along n lines at once.

        (f g)'' = f'' g + 2 f' g' + f g'',   h(f)'' = h''(f) f'^2 + h'(f) f''

    The joints' own formulas run on these numbers: with the velocities as f' they give nu and gamma. No formula is
    differentiated by hand, none by finite differences. `f` may be an array too:
    the quantities of a motion at all its samples.
    """

    __array_ufunc__ = None  # so that an array on the left of an operator leaves it to this class

    f: Any  # float, or an array
    d1: Derivative = 0.0
    d2: Derivative = 0.0

    def __add__(self, other: Taylor | float) -> Taylor:
        o = _lifted(other)
        return Taylor(self.f + o.f, self.d1 + o.d1, self.d2 + o.d2)

    def __neg__(self) -> Taylor:
        return Taylor(-self.f, -self.d1, -self.d2)

    def __sub__(self, other: Taylor | float) -> Taylor:
        o = _lifted(other)
        return Taylor(self.f - o.f, self.d1 - o.d1, self.d2 - o.d2)

    def __rsub__(self, other: float) -> Taylor:
        return _lifted(other) - self

    def __mul__(self, other: Taylor | float) -> Taylor:
        o = _lifted(other)
        return Taylor(self.f * o.f, self.d1 * o.f + self.f * o.d1, self.d2 * o.f + 2.0 * self.d1 * o.d1 + self.f * o.d2)

    def __truediv__(self, other: Taylor | float) -> Taylor:
        o = _lifted(other)
        quotient = self.f / o.f
        d1 = (self.d1 - quotient * o.d1) / o.f
        return Taylor(quotient, d1, (self.d2 - 2.0 * d1 * o.d1 - quotient * o.d2) / o.f)

    def __rtruediv__(self, other: float) -> Taylor:
        return _lifted(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


def _lifted(x: Taylor | float) -> Taylor:
    return x if isinstance(x, Taylor) else Taylor(x if isinstance(x, np.ndarray) else float(x))


def _plain(x: Any) -> Any:
    """Return a scalar of numpy as a float, with which Python computes faster; arrays stay arrays."""
    return x if x.ndim else float(x)


def _chain(x: Taylor, h: Any, h1: Any, h2: Any) -> Taylor:
    """Return h(x) from the value and the two derivatives of h at x.f."""
    return Taylor(h, h1 * x.d1, h2 * x.d1 * x.d1 + h1 * x.d2)


@sin.register
def _(x: Taylor) -> Taylor:
    s, c = _plain(np.sin(x.f)), _plain(np.cos(x.f))
    return _chain(x, s, c, -s)


@cos.register
def _(x: Taylor) -> Taylor:
    s, c = _plain(np.sin(x.f)), _plain(np.cos(x.f))
    return _chain(x, c, -s, -c)


@sqrt.register
def _(x: Taylor) -> Taylor:
    root = _plain(np.sqrt(x.f))
    slope = 0.5 / (np.where(root == 0.0, NO_LENGTH, root) if isinstance(root, np.ndarray) else root or NO_LENGTH)
    return _chain(x, root, slope, -2.0 * slope * slope * slope)


@floor.register
def _(x: Taylor) -> Taylor:
    return Taylor(float(np.floor(x.f)))


@curve.register
def _(x: Taylor, data: CurveData, order: int = 0) -> Taylor:
    return _chain(x, *(curve_value(data, order + k, x.f) for k in range(3)))


@atan2_like.register
def _(like: Taylor, y: Taylor | float, x: Taylor | float) -> Taylor:  # noqa: ARG001
    """w = (x y' - y x') / r^2 and w' = (x y'' - y x'' - 2 w (x x' + y y')) / r^2."""
    y, x = _lifted(y), _lifted(x)
    length = x.f * x.f + y.f * y.f
    squared = np.where(length == 0.0, NO_LENGTH, length) if isinstance(length, np.ndarray) else length or NO_LENGTH
    d1 = (x.f * y.d1 - y.f * x.d1) / squared
    d2 = (x.f * y.d2 - y.f * x.d2 - 2.0 * d1 * (x.f * x.d1 + y.f * y.d1)) / squared
    return Taylor(_plain(np.arctan2(y.f, x.f)), d1, d2)
