"""The value of the driver over a motion, a history: its value at an argument, and the part between two values."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError
from kinfmu.motion.history import History

_SAME = 1e-9  # of the travel of the driver; values closer than this are equal


def driven_at(drive: History, x: FloatArray) -> FloatArray:
    """Return values of the driver at arguments (...), which may be in the period before or after the motion."""
    if drive.is_linear:
        return np.asarray(drive.rate[0] * x + (drive.value[0] - drive.rate[0] * drive.x[0]))
    span, travel = drive.span, drive.value[-1] - drive.value[0]
    turns = np.floor((x - drive.x[0]) / span) if drive.is_closed else np.zeros_like(x)
    found = drive.at((x - turns * span).reshape(-1))[0].reshape(np.shape(x))
    return np.asarray(np.where(np.isnan(x), np.nan, found + turns * travel))


def within_period(drive: History, values: FloatArray) -> FloatArray:
    """Return values (...) with the end of a motion that goes round replaced by its begin."""
    first, last = drive.value[0], drive.value[-1]
    is_end = drive.is_closed & (np.abs(values - last) <= _SAME * np.abs(last - first))
    return np.asarray(np.where(is_end, first, values))


def window(drive: History, begin: float | None, end: float | None) -> tuple[float, float]:
    """Return the first and last argument between two values of the driver; None: its first or last.

    Raises:
        RequestError: The driver turns back or does not reach the values.

    """
    ends = sorted((float(drive.value[0]), float(drive.value[-1])))
    if not (np.all(drive.rate > 0.0) or np.all(drive.rate < 0.0)):
        raise RequestError("'begin' and 'end' need a driver that moves in one direction")
    wanted = [ends[0] if begin is None else begin, ends[1] if end is None else end]
    if drive.is_closed:
        wanted[0] = ends[0] + (wanted[0] - ends[0]) % (ends[1] - ends[0])
        wanted[1] = ends[1] - (ends[1] - wanted[1]) % (ends[1] - ends[0])
    for value in wanted:
        if not ends[0] <= value <= ends[1]:
            raise RequestError(
                f"the driver does not reach {value:.9g}; the motion goes from {ends[0]:.9g} to {ends[1]:.9g}"
            )
    start, stop = (_argument_at(drive, value) for value in wanted)
    if drive.rate[0] < 0.0:
        start, stop = stop, start
    if drive.is_closed and stop <= start:
        stop += drive.span
    if stop <= start:
        raise RequestError(f"'begin' {wanted[0]:.9g} must be before 'end' {wanted[1]:.9g}")
    return start, stop


def _argument_at(drive: History, value: float) -> float:
    """Return the argument at which a driver that moves in one direction has a value that it reaches."""
    for k in (0, -1):
        if value == drive.value[k]:
            return float(drive.x[k])
    return float(drive.crossings(np.asarray(value))[1][0])
