"""Range of values that a plot shows, where the range of all values would mislead."""

from __future__ import annotations

import numpy as np

from kinfmu.run import FloatArray

ROUND_OFF = 1e-9  # relative to a usual value of the motion; smaller curves are noise around 0
OUTLIERS = 1.0  # [percent] of the values on either side that may be outside the plot if they would flatten the others


def shown_range(values: FloatArray, usual: float) -> tuple[float, float] | None:
    """Return the range of an axis where the default, from least to greatest, would mislead; else None.

    Curves that are only round-off, compared with a `usual` value, are shown as a line at 0. A few samples near a
    singular point, where speeds grow without bound, do not flatten all others. The data keep all values.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    if np.abs(known).max() < ROUND_OFF * usual:
        return -usual, usual
    low, high = np.percentile(known, [OUTLIERS, 100.0 - OUTLIERS])
    with np.errstate(over="ignore"):  # the width of the largest numbers is infinite; the default range is used then
        width = high - low
    if width == np.inf:
        return None
    if width > 0.0 and (known.min() < low - width or known.max() > high + width):
        return float(low - width / 2), float(high + width / 2)
    return None
