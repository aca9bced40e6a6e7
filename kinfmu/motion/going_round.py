"""Whether motions go round: the last sample is the first one, after one period."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kinfmu.motion.quintic import ranges
from kinfmu.motion.track import Track

_SAME_POSE = 1e-9  # [rad, sizes]; a motion whose first and last pose differ by less goes round
_SAME_RATE = 1e-6  # of the largest; the same for rates and accelerations


@np.errstate(invalid="ignore")  # of samples without numbers
def goes_round(tracks: Sequence[tuple[Track, bool]]) -> NDArray[np.bool_]:
    """Return whether motions go round: quantities, rates and accelerations of the last sample are those of the first.

    They are compared with their largest values, of angles and of other quantities.

    Args:
        tracks: One or more quantities, each with True if it is an angle, which may be whole turns further.

    Returns:
        (...) True for the designs that go round; False where a sample has no numbers, or nothing moves.

    """
    is_same, moves = np.asarray(True), np.asarray(False)
    for order in range(3):
        scales: dict[bool, NDArray[np.float64]] = {}
        apart: list[tuple[NDArray[np.float64], bool]] = []
        for track, is_angle in tracks:
            row = track.rows[order]
            low, high = ranges(row)
            is_same = is_same & (low <= high)  # both are NaN where a sample has no numbers
            difference = row[..., -1] - row[..., 0]
            if order == 0:
                moves = moves | (high > low)
                difference -= math.tau * np.round(difference / math.tau) if is_angle else 0.0
            size = high - low if order == 0 else np.maximum(high, -low)
            scales[is_angle] = np.maximum(scales.get(is_angle, np.asarray(1e-300)), size)
            apart.append((np.abs(difference), is_angle))
        for difference, is_angle in apart:
            within = _SAME_RATE * scales[is_angle] if order else _SAME_POSE * (1.0 if is_angle else scales[is_angle])
            is_same = is_same & (difference <= within)
    return np.asarray(is_same & moves)
