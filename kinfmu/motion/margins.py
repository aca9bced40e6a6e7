"""The smallest margin of a motion: margins are known at samples only, and have no rates."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError


def lowest(
    x: FloatArray, margin: FloatArray, window: tuple[float, float] | None, *, is_closed: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the smallest margin of the samples in a window, and where it occurs.

    Args:
        x: (n,) arguments of the samples.
        margin: (..., n) their margins.
        window: First and last argument; the last may be in the next period. None: all samples.
        is_closed: True if the motion goes round.

    Raises:
        RequestError: No sample is in the window.

    """
    first, last = window or (x[0], x[-1])
    shifts = (0.0, x[-1] - x[0]) if is_closed else (0.0,)
    repeated = np.concatenate([x + shift for shift in shifts])
    inside = (repeated >= first) & (repeated <= last)
    if not inside.any():
        raise RequestError("no sample of the motion is between 'begin' and 'end'")
    margins = np.concatenate([margin] * len(shifts), axis=-1)[..., inside]
    k = np.argmin(margins, axis=-1)
    value = np.take_along_axis(margins, k[..., None], -1)[..., 0]
    return value, np.where(np.isnan(value), np.nan, repeated[inside][k])
