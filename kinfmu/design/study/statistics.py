"""Mean, deviation and extremes of the columns of a table that is read part by part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray


@dataclass(frozen=True)
class Statistics:
    """Statistics of the designs that have a number.

    Attributes:
        count: How many have one.
        mean: Mean.
        deviation: Standard deviation of the sample (n - 1); nan of fewer than two.
        low: Smallest.
        high: Largest.
        missing: How many have none.

    """

    count: int
    mean: float
    deviation: float
    low: float
    high: float
    missing: int


class Moments:
    """Statistics of numbers that arrive part by part (Chan, Golub, LeVeque 1979)."""

    def __init__(self) -> None:
        self._count = self._missing = 0
        self._mean = self._squares = 0.0
        self._low, self._high = np.inf, -np.inf

    def add(self, numbers: FloatArray) -> None:
        """Add numbers (m,); those that are not finite count as missing."""
        known = numbers[np.isfinite(numbers)]
        self._missing += len(numbers) - len(known)
        if not len(known):
            return
        count = self._count + len(known)
        mean = float(known.mean())
        apart = mean - self._mean
        self._squares += float(((known - mean) ** 2).sum()) + apart**2 * self._count * len(known) / count
        self._mean += apart * len(known) / count
        self._count = count
        self._low, self._high = min(self._low, float(known.min())), max(self._high, float(known.max()))

    def statistics(self) -> Statistics:
        """Return the statistics of all numbers so far."""
        if not self._count:
            return Statistics(0, np.nan, np.nan, np.nan, np.nan, self._missing)
        deviation = (self._squares / (self._count - 1)) ** 0.5 if self._count > 1 else np.nan
        return Statistics(self._count, self._mean, deviation, self._low, self._high, self._missing)
