"""Samples that lie much closer together than the others: they add nothing but rounding to derivatives.

Estimates of third derivatives divide by the cube of the distance of two samples. So of samples that are close to each
other, and whose accelerations are nearly the same, one is kept.
"""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray, IntArray

_CLOSE = 0.1  # of the mean distance of samples
_EQUAL = 0.03  # of the largest acceleration; samples that differ by more follow a steep change and are all kept
_ROUNDING = 1e-9  # of the largest rate over the mean distance; the same for accelerations that are 0 but for rounding


def is_crowded(x: FloatArray) -> bool:
    """Return whether some of the ascending arguments (n,) are much closer than the others; equal ones are breaks."""
    steps = np.diff(x)
    return bool(((steps > 0.0) & (steps < _CLOSE * _mean(x))).any())


def spread(x: FloatArray, rates: FloatArray, accelerations: FloatArray) -> IntArray:
    """Return the numbers of the samples to keep: ends, both sides of breaks, of close and nearly equal ones the first.

    Args:
        x: (n,) ascending arguments; a break is there twice.
        rates: (n, m) rates of the outputs.
        accelerations: (n, m) their accelerations. Samples without numbers are kept.

    """
    mean = _mean(x)
    with np.errstate(invalid="ignore"):
        sizes = [np.nanmax(np.abs(table), axis=0, initial=0.0) for table in (accelerations, rates)]
    limit = _EQUAL * sizes[0] + _ROUNDING * sizes[1] / mean
    is_break = np.zeros(len(x), dtype=bool)
    before = np.flatnonzero(np.diff(x) == 0.0)
    is_break[[0, -1, *before, *(before + 1)]] = True
    kept = [0]
    for k in range(1, len(x)):
        while (
            x[k] - x[kept[-1]] < _CLOSE * mean and (np.abs(accelerations[k] - accelerations[kept[-1]]) <= limit).all()
        ):
            if not is_break[k]:
                break
            if is_break[kept[-1]]:
                kept.append(k)
                break
            kept.pop()
        else:
            kept.append(k)
    return np.array(kept)


def _mean(x: FloatArray) -> float:
    return float(x[-1] - x[0]) / (len(x) - 1)
