"""Rates of a driver estimated from samples of its value, for hosts that wire no rates. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

Sample = tuple[float, tuple[float, ...]]  # a communication point t [s] and the driver values u there


def estimated_rates(
    earlier: Sequence[Sample], t: float, u: Sequence[float]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Speed and acceleration of each driver at t, from the parabola through its last three samples.

        a = 2 (d2 - d1) / (t2 - t0),   v = d2 + a (t2 - t1) / 2,   d1, d2 the slopes of the two intervals

    Backward differences on a non-uniform grid: v is O(h^2), a is O(h). earlier: committed samples, oldest first, of
    which those before t count; one of them gives a slope, none gives 0.
    """
    count = len(earlier)
    while count and earlier[count - 1][0] >= t:
        count -= 1
    if not count:
        rest = (0.0,) * len(u)
        return rest, rest
    t1, u1 = earlier[count - 1]
    h2 = t - t1
    if count == 1:
        return tuple([(u[k] - u1[k]) / h2 for k in range(len(u))]), (0.0,) * len(u)
    t0, u0 = earlier[count - 2]
    h1 = t1 - t0
    speeds: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()
    for k, value in enumerate(u):  # grown one by one: for the one or two drivers there are, faster than a list
        d2 = (value - u1[k]) / h2
        acceleration = 2.0 * (d2 - (u1[k] - u0[k]) / h1) / (h1 + h2)
        speeds += (d2 + 0.5 * acceleration * h2,)
        accelerations += (acceleration,)
    return speeds, accelerations
