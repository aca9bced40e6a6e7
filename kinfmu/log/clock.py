"""Simulation time in the nanoseconds that logs count in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import LogError
from kinfmu.run import FloatArray

NANOSECONDS = 1_000_000_000
LATEST = 2.0**31 - 1.0  # [s]; a ROS 2 time stamp holds its seconds in 32 bits


def nanoseconds(t: FloatArray) -> NDArray[np.int64]:
    """Return times (n,) [s] as whole nanoseconds, rounded: truncation would make times of a 1 ms grid 1 ns too low."""
    bad = ~(np.abs(t) <= LATEST)
    if bad.any():
        row = int(np.argmax(bad))
        raise LogError(f"time of sample {row} is {t[row]} s; a log needs a number within +-{LATEST:.0f} s")
    return np.rint(t * NANOSECONDS).astype(np.int64)


def zero_of(t: FloatArray) -> int:
    """Return the origin of log times [whole s]: 0, or less if the run begins before 0.

    MCAP's times are unsigned, so the log times of a run that begins at -0.5 s are counted from -1 s.
    """
    return min(0, int(np.floor(t.min()))) if len(t) else 0
