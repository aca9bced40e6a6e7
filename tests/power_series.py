"""Truncated power series in many digits: exact derivatives of every order for the oracle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mpmath

DIGITS = 50  # of every result of the oracle
mp = mpmath.MPContext()  # a context of its own: other settings of digits do not change it
mp.dps = DIGITS + 30  # near a singular point each derivative costs up to four digits; 16 for a double next to one

Real = Any  # an mpmath number


class Series:
    """A power series c[0] + c[1] t + c[2] t^2 + ..., cut off after len(c) terms."""

    __slots__ = ("c",)

    def __init__(self, coefficients: Iterable[Any]) -> None:
        self.c: list[Real] = [mp.mpf(value) for value in coefficients]

    def _like(self, other: Any) -> Series:
        """`other` as a series: a number is a constant."""
        return other if isinstance(other, Series) else Series([other] + [0] * (len(self.c) - 1))

    def __neg__(self) -> Series:
        return Series(-a for a in self.c)

    def __add__(self, other: Any) -> Series:
        return Series(a + b for a, b in zip(self.c, self._like(other).c, strict=True))

    def __sub__(self, other: Any) -> Series:
        return Series(a - b for a, b in zip(self.c, self._like(other).c, strict=True))

    def __rsub__(self, other: Any) -> Series:
        return self._like(other) - self

    def __mul__(self, other: Any) -> Series:
        b = self._like(other).c
        return Series(mp.fdot((self.c[i], b[k - i]) for i in range(k + 1)) for k in range(len(b)))

    def __truediv__(self, other: Any) -> Series:
        b = self._like(other).c
        quotient: list[Real] = []
        for k, a in enumerate(self.c):
            quotient.append((a - mp.fdot((quotient[i], b[k - i]) for i in range(k))) / b[0])
        return Series(quotient)

    def __rtruediv__(self, other: Any) -> Series:
        return self._like(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def derivative(self) -> Series:
        """The series of the derivative; its last term is not known any more and is cut off."""
        return Series(k * a for k, a in enumerate(self.c[1:], start=1))

    def integral(self, constant: Real) -> Series:
        """The series of the integral that starts at `constant`, one term longer."""
        return Series([constant, *(a / k for k, a in enumerate(self.c, start=1))])

    def at(self, t: Real) -> Real:
        """The sum of its terms at t."""
        return mp.fdot((a, t**k) for k, a in enumerate(self.c))

    def cut(self, count: int) -> Series:
        """The first `count` terms."""
        return Series(self.c[:count])


def sin_cos(x: Series) -> tuple[Series, Series]:
    """Sine and cosine of x, from s' = c x' and c' = -s x'."""
    s, c = [mp.sin(x.c[0])], [mp.cos(x.c[0])]
    for k in range(1, len(x.c)):
        s.append(mp.fdot((i * x.c[i], c[k - i]) for i in range(1, k + 1)) / k)
        c.append(-mp.fdot((i * x.c[i], s[k - i]) for i in range(1, k + 1)) / k)
    return Series(s), Series(c)


def sin(x: Series) -> Series:
    """Sine of an angle."""
    return sin_cos(x)[0]


def cos(x: Series) -> Series:
    """Cosine of an angle."""
    return sin_cos(x)[1]


def sqrt(x: Series) -> Series:
    """The positive square root, from r r = x."""
    root = [mp.sqrt(x.c[0])]
    for k in range(1, len(x.c)):
        root.append((x.c[k] - mp.fdot((root[i], root[k - i]) for i in range(1, k))) / (2 * root[0]))
    return Series(root)


def asin(x: Series) -> Series:
    """The inverse sine in [-pi/2, pi/2], from its derivative x' / sqrt(1 - x^2)."""
    rate = x.derivative() / sqrt(1 - x * x).cut(len(x.c) - 1)
    return rate.integral(mp.asin(x.c[0]))


def atan2(y: Series, x: Series) -> Series:
    """The angle of (x, y) in (-pi, pi], from its derivative (x y' - y x') / (x^2 + y^2)."""
    short = len(x.c) - 1
    xs, ys = x.cut(short), y.cut(short)
    rate = (xs * y.derivative() - ys * x.derivative()) / (xs * xs + ys * ys)
    return rate.integral(mp.atan2(y.c[0], x.c[0]))


def angle(y: Any, x: Any) -> Series:
    """atan2 where one of the two may be a number."""
    return atan2(y if isinstance(y, Series) else x._like(y), x if isinstance(x, Series) else y._like(x))


def floor(x: Series) -> Series:
    """The largest whole number below, which stands still."""
    return x * 0 + mp.floor(x.c[0])


def curve(x: Series, data: tuple[Any, Any]) -> Series:
    """A piecewise function by its definition: a polynomial of s and a sin(w s + p), on the piece that holds x."""
    breaks, pieces = data
    origin, coefficients, a, w, p = pieces[sum(limit <= x.c[0] for limit in breaks)]
    s = x - origin
    value = x * 0
    for coefficient in coefficients:
        value = value * s + coefficient
    return value + sin(s * w + p) * a
