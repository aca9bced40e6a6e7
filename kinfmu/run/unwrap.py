"""Unwrapping of angles that were wrapped into one turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinfmu.solver.python.bridge import TURN, turned

_HALF = 0.5 + 1e-9  # [turns]; a step of half a turn, within rounding, is unchanged


def unwrap(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles, each moved by whole turns to within half a turn of the one before.

        350, 10, 350 deg -> 350, 370, 350 deg

    angles: (n,) [rad]; the first is unchanged.
    """
    steps = np.diff(angles) / TURN
    back = np.sign(steps) * np.ceil(np.abs(steps) - _HALF)  # [turns]
    turns = -np.concatenate([[0.0], np.cumsum(back)])[: len(angles)]
    return np.array([turned(angle, n) for angle, n in zip(angles.tolist(), turns.tolist(), strict=True)])  # (n,)


def is_long(steps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which steps between angles [rad] are longer than half a turn, so that unwrapping changes them."""
    return np.abs(steps) > _HALF * TURN
