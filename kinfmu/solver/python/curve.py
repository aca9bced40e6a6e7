"""A piecewise function of one variable: laws of motion and lifts of cams at run time."""

from __future__ import annotations

from bisect import bisect_right
from functools import cache
from math import cos, perm, sin

Piece = tuple[
    float, tuple[float, ...], float, float, float
]  # origin o, coefficients, amplitude a, frequency w, phase p
CurveData = tuple[tuple[float, ...], tuple[Piece, ...]]  # n - 1 ascending breaks, n pieces


def curve(data: CurveData, order: int, x: float) -> float:
    """Return the derivative of the given order (0: the value) at x.

        f = c_0 s^n + ... + c_n + a sin(w s + p),   s = x - o        on the piece that holds x

    data: the breaks between pieces, in ascending order, and the pieces (o, (c_0, ..., c_n), a, w, p), highest power
    first. A piece holds from its left break on: at a break the right-hand piece counts. The first piece holds for all x
    before the first break, the last one for all after the last.
    """
    breaks, pieces = data
    o, coefficients, a, w, p = pieces[bisect_right(breaks, x)]
    s = x - o
    value = 0.0 * s  # NaN stays NaN where a piece is constant
    if order == 0:
        for c in coefficients:
            value = value * s + c
        return value + a * sin(w * s + p) if a else value
    for c, factor in zip(coefficients, _factors(len(coefficients), order), strict=False):
        value = value * s + factor * c
    if a:
        quarter = order % 4  # sine, cosine, and the same with other signs
        wave = cos(w * s + p) if quarter % 2 else sin(w * s + p)
        value += (a if quarter < 2 else -a) * w**order * wave
    return value


@cache
def _factors(count: int, order: int) -> tuple[float, ...]:
    """Return the factors of the derivatives of s^n, n!/(n - order)!, for n from count - 1 down to order."""
    return tuple(float(perm(power, order)) for power in range(count - 1, order - 1, -1))
