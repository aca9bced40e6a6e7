"""Arguments of a motion: the nearest point of a curve to given rows, and where an output has given values.

Both begin from samples of the whole motion and continue with Newton steps on exact poses.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kinfmu.run import FloatArray

_ROUNDS = 3  # Newton steps on exact poses, from a sample at most half a spacing away
Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]  # u (m,) -> values, rates, accelerations


class NotReachedError(Exception):
    """An output never has a wanted value."""


def nearest(
    u: FloatArray, curve: Curve, wanted: FloatArray, periods: FloatArray, ends: tuple[float, float] | None
) -> FloatArray:
    """Return the arguments (m,) of the points of a curve that are nearest to given rows.

        r.P' = 0,   du = -r.P' / (P'.P' + r.P'')   with r = P - wanted

    Args:
        u: (n,) arguments of samples of the whole motion.
        curve: Values, rates and accelerations (m, d) at arguments (m,).
        wanted: (m, d).
        periods: (d,) what differences may differ by, such as a whole turn; inf: nothing.
        ends: Smallest and largest argument; None: the curve is closed.

    """
    samples = curve(u)
    known = np.isfinite(samples[0]).all(axis=1)
    if not known.any():
        raise NotReachedError
    distances = (modulo(samples[0][None, :, :] - wanted[:, None, :], periods) ** 2).sum(axis=2)
    k = np.where(known, distances, np.inf).argmin(axis=1)
    spacing = abs(float(u[1] - u[0]))
    low, high = u[k] - spacing, u[k] + spacing
    if ends is not None:
        low, high = np.maximum(low, min(ends)), np.minimum(high, max(ends))
    found = np.clip(u[k] + _to_foot(samples[0][k], samples[1][k], samples[2][k], wanted, periods, spacing), low, high)
    for _ in range(_ROUNDS):
        p, v, a = curve(found)
        found = np.clip(found + np.nan_to_num(_to_foot(p, v, a, wanted, periods, spacing)), low, high)
    return np.asarray(found)


def modulo(r: FloatArray, periods: FloatArray) -> FloatArray:
    """Return the smallest differences that are equal to r (..., d) up to whole periods."""
    if not np.isfinite(periods).any():
        return r
    turns = np.where(np.isfinite(periods), np.round(r / periods), 0.0)
    return np.asarray(r - turns * np.where(np.isfinite(periods), periods, 0.0))


def _to_foot(
    p: FloatArray, v: FloatArray, a: FloatArray, wanted: FloatArray, periods: FloatArray, spacing: float
) -> FloatArray:
    """Return the step to the nearest point."""
    r = modulo(p - wanted, periods)
    slope, along = (r * v).sum(axis=1), (v * v).sum(axis=1)
    curvature = along + (r * a).sum(axis=1)
    curvature = np.where(curvature > 0.1 * along, curvature, along)
    step = np.divide(-slope, curvature, out=np.zeros_like(slope), where=curvature > 0.0)
    return np.asarray(np.clip(step, -spacing, spacing))


def crossings(u: FloatArray, curve: Curve, levels: FloatArray) -> FloatArray:
    """Return the arguments (m,) at which a curve of one output has given values.

    Where it has a value several times, the one nearest to the argument before counts; for the first value the first.

    Args:
        u: (n,) arguments of samples of the whole motion.
        curve: Values, rates and accelerations (m, 1) at arguments (m,).
        levels: (m,).

    Raises:
        NotReachedError: The output never has one of the values.

    """
    x = curve(u)[0][:, 0]
    spacing = abs(float(u[1] - u[0]))
    found, before = np.empty(len(levels)), float(u[0])
    for j, level in enumerate(levels):
        gap = x - level
        places = np.flatnonzero((gap[:-1] <= 0.0) != (gap[1:] <= 0.0))
        places = places[np.isfinite(gap[places]) & np.isfinite(gap[places + 1])]
        guesses = u[places] - gap[places] * (u[places + 1] - u[places]) / (gap[places + 1] - gap[places])
        if not len(guesses):
            guesses = u[[int(np.nanargmin(np.abs(gap)))]] if np.isfinite(gap).any() else guesses
        if not len(guesses):
            raise NotReachedError
        before = found[j] = guesses[int(np.abs(guesses - before).argmin())]
    for _ in range(_ROUNDS):
        p, v, _ = (table[:, 0] for table in curve(found))
        with np.errstate(all="ignore"):
            found = found + np.clip(np.nan_to_num((levels - p) / v), -spacing, spacing)
    if not np.abs(curve(found)[0][:, 0] - levels).max() <= 1e-6 * (np.abs(levels).max() + np.nanmax(np.abs(x))):
        raise NotReachedError
    return np.asarray(found)
