"""Arguments at which a law jumps: in its value, rate or acceleration."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import NamedTuple

from kinfmu.measures.arithmetic import Value
from kinfmu.solver.python.curve import CurveData, curve

SAME = 1e-9  # of the largest value at the breaks and midway between them; smaller differences are rounding


class Jumps(NamedTuple):
    """Arguments at which a law jumps.

    Attributes:
        at: Those of one period, in any order.
        period: The distance at which they repeat, 0 if they do not.

    """

    at: tuple[Value, ...] = ()
    period: Value = 0.0


@cache
def jumping_breaks(data: CurveData) -> tuple[float, ...]:
    """Return the breaks of a curve at which its value, first or second derivative differs between the two sides."""
    breaks, pieces = data
    found = set()
    for order in range(3):
        sides = [
            (curve(((), (before,)), order, x), curve(((), (after,)), order, x))
            for x, (before, after) in zip(breaks, pairwise(pieces), strict=True)
        ]
        between = [curve(data, order, 0.5 * (a + b)) for a, b in pairwise(breaks)]
        largest = max((abs(value) for value in (*between, *(one for side in sides for one in side))), default=0.0)
        found |= {x for x, (left, right) in zip(breaks, sides, strict=True) if abs(right - left) > SAME * largest}
    return tuple(sorted(found))
