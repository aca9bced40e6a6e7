"""Rates of a driver estimated from samples of its value, for hosts that wire no rates. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence

Sample = tuple[float, tuple[float, ...]]  # a communication point t [s] and the driver values u there


def estimated_rates(
    samples: Sequence[Sample], t: float, u: Sequence[float]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Speed and acceleration of each driver at t, from the parabola through its last three samples.

        a = 2 (d2 - d1) / (t2 - t0),   v = d2 + a (t2 - t1) / 2,   d1, d2 the slopes of the two intervals

    Backward differences on a non-uniform grid: v is O(h^2), a is O(h). samples: committed ones, oldest first, of which
    those before t count; one of them gives a slope, none gives 0.
    """
    count = len(samples)
    if count == 3 and samples[1][0] < t <= samples[2][0] and len(u) == 1:  # most calls: at the last of three samples
        (first, (a,)), (second, (b,)) = samples[0], samples[1]
        slope = (u[0] - b) / (t - second)
        curve = 2.0 * (slope - (b - a) / (second - first)) / (t - first)
        return (slope + 0.5 * curve * (t - second),), (curve,)
    while count and samples[count - 1][0] >= t:
        count -= 1
    if not count:
        rest = (0.0,) * len(u)
        return rest, rest
    t1, u1 = samples[count - 1]
    h2 = t - t1
    if count == 1:
        return tuple([(u[k] - u1[k]) / h2 for k in range(len(u))]), (0.0,) * len(u)
    t0, u0 = samples[count - 2]
    speeds, accelerations = [], []
    for a, b, c in zip(u0, u1, u, strict=True):
        d2 = (c - b) / h2
        acceleration = 2.0 * (d2 - (b - a) / (t1 - t0)) / (t - t0)
        speeds.append(d2 + 0.5 * acceleration * h2)
        accelerations.append(acceleration)
    return tuple(speeds), tuple(accelerations)
