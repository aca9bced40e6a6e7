"""Poles of ratios of speeds: places where the speed below passes 0 while that above does not."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.motion.history import History

_SLOW = 1e-6  # of the largest speed; of two quantities that turn back together both are
_RESTING = 1e-12  # of the largest speed, at a sample


def first_pole(over: History, under: History) -> FloatArray:
    """Return (...) the first place where the ratio of two speeds has no bound, NaN for designs without one."""
    over, under = (
        History.of(one, one.taylor + 0.0 * other.taylor) for one, other in ((over, under), (under, over))
    )  # both with an axis of designs if one has it
    design, x = under.crossings(np.zeros(under.value.shape[:-1]))
    speeds = np.abs(under.value.reshape(-1, len(under.x)))
    resting = np.nonzero(speeds <= _RESTING * speeds.max(axis=1, keepdims=True))
    design, x = np.append(design, resting[0]), np.append(x, under.x[resting[1]])
    own = over.of_designs(design)
    moves = np.abs(own.at(x[:, None])[0][:, 0]) > _SLOW * np.abs(own.value).max(axis=1)
    first = np.full(len(speeds), np.inf)
    np.minimum.at(first, design[moves], x[moves])
    return np.where(np.isfinite(first), first, np.nan).reshape(over.value.shape[:-1])
