"""Whether motions go round: the last sample is the first one, after one period."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.motion.history import History
from kinfmu.motion.quintic import ranges

_SAME_POSE = 1e-9  # [rad, sizes]; a motion whose first and last pose differ by less goes round
_SAME_RATE = 1e-6  # of the largest; the same for rates and accelerations
_FEW = 5  # samples


Ranges = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # smallest and largest number of each row (..., n)


def goes_round(
    histories: Sequence[tuple[History, bool]], is_known: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Return whether motions go round: quantities, rates and accelerations of the last sample are those of the first.

    They are compared with their largest values, of angles and of other quantities.

    Args:
        histories: One or more quantities, each with True if it is an angle, which may be whole turns further.
        is_known: (...) True for the designs whose samples all have numbers: of those a few samples usually show that
            the motion is large enough, and the others are not looked at. Default: every sample is looked at.

    Returns:
        (...) True for the designs that go round; False where a sample has no numbers, or nothing moves.

    """
    if is_known is not None:
        found = is_known & _ends_agree(histories, _ranges_of_few)
        if (found == is_known).all():
            return np.asarray(found)
    return _ends_agree(histories, ranges)


@np.errstate(invalid="ignore")  # of samples without numbers
def _ends_agree(histories: Sequence[tuple[History, bool]], ranges_of: Ranges) -> NDArray[np.bool_]:
    is_same, moves = np.asarray(True), np.asarray(False)
    for order in range(3):
        scales: dict[bool, FloatArray] = {}
        apart: list[tuple[FloatArray, bool]] = []
        for history, is_angle in histories:
            row = history.rows[order]
            low, high = ranges_of(row)
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


def _ranges_of_few(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return smallest and largest numbers of a few samples: the range of all is at least as large."""
    some = np.moveaxis(table, -1, 0)[:: -(-table.shape[-1] // _FEW)].copy()
    return some.min(axis=0), some.max(axis=0)
