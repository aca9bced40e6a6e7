"""Engines, and settings of a Newton solver: how a sample is predicted, and when correcting it ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from benchmarks.case import Case, Motion

Sampler = Callable[[int], Motion]  # takes the first n samples of a case, and gives a row of q, qd, qdd for each
GAP = float("nan")  # in place of numbers that were not found
ROUND_OFF = 0.0  # tolerance: as far as rounding lets it
PREDICTORS = ("last pose", "velocity", "velocity and acceleration")


class EngineSetting(NamedTuple):
    """predictor: 0, 1 or 2 terms of the Taylor series beyond the last pose; tolerance: residual relative to the size at
    which correcting ends; corrections: their number if it is fixed; chord: the Jacobian of the prediction serves for
    all corrections of a sample, rates take that of the pose.
    """

    predictor: int = 2
    tolerance: float = ROUND_OFF
    corrections: int | None = None
    chord: bool = False

    @property
    def stop(self) -> str:
        """'round-off', '1e-06' or '2 corrections'."""
        if self.corrections is not None:
            return f"{self.corrections} correction{'s' * (self.corrections != 1)}"
        return f"{self.tolerance:.0e}" if self.tolerance else "round-off"


USUAL = EngineSetting()


@dataclass(frozen=True)
class BenchEngine:
    """Something that solves the samples of a case, in one or more settings.

    name: in tables and charts; sampler: makes a function that takes samples, ready to be timed, or None if the engine
    cannot state the mechanism, and raises MissingPackageError if a package is not installed; settings: those worth a
    measurement; usual: the one of them for round-off; laps: how often a call of a sampler takes the samples, more than
    once for engines made for long arrays.
    """

    name: str
    sampler: Callable[[Case, EngineSetting], Sampler | None]
    settings: Sequence[EngineSetting] = (USUAL,)
    usual: EngineSetting = USUAL
    laps: int = 1
