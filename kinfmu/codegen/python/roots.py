"""The square root of stages, for numbers. FMUs with forces have a copy: standard library only."""

from __future__ import annotations

import math


class _Zero(float):
    """The root of 0: what is divided by it, or by a multiple of it, is not a number, as in C."""

    __slots__ = ()

    def __mul__(self, other: float) -> _Zero:
        return self

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> float:
        return 0.0 / other if other else math.nan

    def __rtruediv__(self, other: float) -> float:
        return math.nan


_ZERO = _Zero()


def sqrt(x: float) -> float:
    """Return the square root; divisions by that of 0 raise no error, so that other results keep their values."""
    return math.sqrt(x) or _ZERO
