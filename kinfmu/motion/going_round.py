"""Whether motions go round: the last sample is the first one, after one period."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kinfmu.motion.track import FloatArray
from kinfmu.units import CoordinateName

_SAME_POSE = 1e-9  # [rad, sizes]; a motion whose first and last pose differ by less goes round
_SAME_RATE = 1e-6  # of the largest; the same for rates and accelerations


def goes_round(names: Sequence[CoordinateName], tables: Sequence[FloatArray]) -> NDArray[np.bool_]:
    """Return whether motions go round: pose, rates and accelerations of the last sample are those of the first.

    Args:
        names: Names of the k coordinates that are compared.
        tables: Their values, rates and accelerations, (..., n, k) each.

    Returns:
        (...) True for the designs that go round; False where a sample has no numbers, or nothing moves.

    """
    is_angle = np.array([name.is_angle for name in names], bool)
    values = tables[0]
    apart = values[..., -1, :] - values[..., 0, :]
    apart = np.where(is_angle, apart - math.tau * np.round(apart / math.tau), apart)
    travel = values.max(axis=-2, initial=-np.inf) - values.min(axis=-2, initial=np.inf)
    size = np.maximum(travel[..., ~is_angle].max(axis=-1, initial=0.0), 1e-300)[..., None]
    is_same = np.all(np.abs(apart) <= _SAME_POSE * np.where(is_angle, 1.0, size), axis=-1)
    for table in tables[1:]:
        largest = np.maximum(table.max(axis=-2, initial=0.0), -table.min(axis=-2, initial=0.0))
        of_kind = np.where(
            is_angle,
            largest[..., is_angle].max(axis=-1, initial=0.0)[..., None],
            largest[..., ~is_angle].max(axis=-1, initial=0.0)[..., None],
        )
        is_same &= np.all(np.abs(table[..., -1, :] - table[..., 0, :]) <= _SAME_RATE * of_kind, axis=-1)
    return np.asarray(is_same & (travel > 0.0).any(axis=-1))
