"""Sensitivities through bridges: interpolated across a singular point from both sides, or NaN.

At a change point J is singular, and J z_p = -r_p has a solution only if the parameter keeps the change point: a factor
of all lengths, a parameter that changes two equal lengths, the constants of laws. Then z_p(u) is as smooth there as
z(u). Any other parameter removes the change point: z_p grows as 1 / (u - u*) on both sides, and there is no derivative
at u*.

Hermite interpolations of z_p and its rate, through 6 and through 8 regular poses on both sides, tell one from the
other: they agree where z_p is smooth, and are far apart where it has a pole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.solver.python.status import Status

SPACING = 0.0125  # [rad, sizes] between poses; windows are at most 0.1 wide on either side
POSES = 20  # on either side, of which the nearest regular ones count
FEW, MANY = 3, 4  # poses on either side of the two interpolations
AGREED = 1e-7  # largest difference of the two, as a part of the largest number interpolated
SAME = 1e-8  # likewise of the interpolated and the solved positions: a larger one is another branch


class Columns(NamedTuple):
    """Numbers at samples (n,) and their derivatives with respect to the driver value or time; (n, columns) each."""

    values: FloatArray
    slopes: FloatArray
    status: IntArray


def interpolated(
    x: FloatArray,
    spacing: FloatArray,
    status: IntArray,
    known: FloatArray,
    least: FloatArray,
    solve: Callable[[FloatArray], Columns],
) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield for each bridge its samples, with the interpolated columns and their slopes, (samples, columns) each.

    Args:
        x: (n,) driver values or times.
        spacing: (n,) of the poses, in the unit of x.
        status: (n,) of the samples.
        known: (n, m) positions that the first m columns must have; NaN: unknown.
        least: (columns,) numbers that count as 1 of a column; smaller columns are judged by them.
        solve: Gives the columns at any x; their numbers are used where the status is 0.

    Returns:
        Samples of each bridge and their columns; NaN where a column has no derivative.

    """
    from scipy.interpolate import KroghInterpolator  # slow to import, and few motions need it

    bridged = np.flatnonzero((status == Status.BRIDGED) & np.isfinite(spacing) & (spacing > 0.0))
    bridged = bridged[np.argsort(x[bridged], kind="stable")]
    steps = np.arange(1, POSES + 1)
    for group in np.split(bridged, np.flatnonzero(np.diff(x[bridged]) > spacing[bridged[1:]]) + 1):
        if len(group) == 0:
            continue
        step = float(spacing[group].min())
        there = np.concatenate([x[group[0]] - step * steps[::-1], x[group[-1]] + step * steps])
        found = solve(there)
        regular = found.status == Status.OK
        before, after = np.flatnonzero(regular[:POSES])[::-1], POSES + np.flatnonzero(regular[POSES:])
        if min(len(before), len(after)) < MANY:
            continue
        middle = 0.5 * float(x[group[0]] + x[group[-1]])
        places = (x[group] - middle) / step
        results = []
        for count in (FEW, MANY):
            nodes = np.stack([before[:count], after[:count]], axis=1).ravel()
            curve = KroghInterpolator(
                np.repeat((there[nodes] - middle) / step, 2),
                np.stack([found.values[nodes], found.slopes[nodes] * step], axis=1).reshape(4 * count, -1),
            )
            values, slopes = curve.derivatives(places, der=2)
            results.append((values, slopes / step))
        (rough, rough_slopes), (values, slopes) = results
        nodes = np.concatenate([before[:MANY], after[:MANY]])
        largest = np.maximum(np.abs(found.values[nodes]).max(axis=0), least)
        fastest = np.maximum(np.abs(found.slopes[nodes]).max(axis=0), largest * (SPACING / step))
        good = (np.abs(values - rough) <= AGREED * largest).all(axis=0)
        good &= (np.abs(slopes - rough_slopes) <= AGREED * fastest).all(axis=0)
        m = known.shape[1]
        good &= not (np.abs(values[:, :m] - known[group]) > SAME * largest[:m]).any()
        yield group, np.where(good, values, np.nan), np.where(good, slopes, np.nan)
