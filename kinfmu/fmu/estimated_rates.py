"""Rates of a driver estimated from samples of its value, for hosts that wire no rates. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Sample(NamedTuple):
    """The driver values u at a communication point t [s]."""

    t: float
    u: tuple[float, ...]


def estimated_rates(earlier: Sequence[Sample], t: float, u: Sequence[float]) -> tuple[list[float], list[float]]:
    """Speed and acceleration of each driver at t, from the parabola through its last three samples.

        a = 2 (d2 - d1) / (t2 - t0),   v = d2 + a (t2 - t1) / 2,   d1, d2 the slopes of the two intervals

    Backward differences on a non-uniform grid: v is O(h^2), a is O(h). earlier: committed samples, oldest first, of
    which those before t count; one of them gives a slope, none gives 0.
    """
    before = [sample for sample in earlier if sample.t < t][-2:]
    if not before:
        return [0.0] * len(u), [0.0] * len(u)
    h2 = t - before[-1].t
    slopes = [(u2 - u1) / h2 for u1, u2 in zip(before[-1].u, u, strict=True)]
    if len(before) == 1:
        return slopes, [0.0] * len(u)
    (t0, u0), (t1, u1) = before
    h1 = t1 - t0
    speeds, accelerations = [], []
    for k, d2 in enumerate(slopes):
        acceleration = 2.0 * (d2 - (u1[k] - u0[k]) / h1) / (h1 + h2)
        speeds.append(d2 + 0.5 * acceleration * h2)
        accelerations.append(acceleration)
    return speeds, accelerations
