"""Which range of values a plot shows, where the range of all of them would mislead."""

from __future__ import annotations

import numpy as np

from kinfmu.run import FloatArray

ROUND_OFF = 1e-9  # part of what a motion of this size and duration has, below which curves are noise around 0
OUTLIERS = 1.0  # [percent] on either side, that may leave the plot if they would flatten all the rest


def shown_range(values: FloatArray, usual: float) -> tuple[float, float] | None:
    """Range of the axis where the usual choice, from least to greatest, would mislead.

    Curves that are round-off against what is `usual` are a line at 0, not a storm; a few samples beside a singular
    point, where speeds grow without bound, do not flatten all others. The data hold everything.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    if np.abs(known).max() < ROUND_OFF * usual:
        return -usual, usual
    low, high = np.percentile(known, [OUTLIERS, 100.0 - OUTLIERS])
    with np.errstate(over="ignore"):  # infinite where numbers are as large as they get: the usual choice then
        width = high - low
    if width == np.inf:
        return None
    if width > 0.0 and (known.min() < low - width or known.max() > high + width):
        return float(low - width / 2), float(high + width / 2)
    return None
