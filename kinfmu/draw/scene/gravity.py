"""The direction of gravity, as pictures show it."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism


def gravity_direction(mechanism: Mechanism) -> FloatArray | None:
    """Return the unit vector (2,) of gravity in the world; None without gravity or without bodies with masses."""
    pull = np.array(mechanism.gravity or (0.0, 0.0), dtype=float)
    if not pull.any() or not any(body.mass for body in mechanism.moving_bodies):
        return None
    return np.asarray(pull / np.hypot(*pull))
