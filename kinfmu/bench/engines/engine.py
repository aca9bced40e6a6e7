"""What the bench asks of an engine."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from kinfmu.bench.case import Case, Motion
from kinfmu.bench.setting import Setting

Sampler = Callable[[int], Motion]  # takes the first n samples of a case, and gives a row of q, qd, qdd for each
GAP = float("nan")  # in place of numbers that were not found


class Engine(ABC):
    """Something that solves the samples of a case, in one or more settings."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Name in tables and plots."""

    @property
    @abstractmethod
    def settings(self) -> Sequence[Setting]:
        """Settings that are worth a measurement; `usual` is among them."""

    @property
    @abstractmethod
    def usual(self) -> Setting:
        """The setting that somebody would use who wants round-off."""

    @property
    def laps(self) -> int:
        """How often a call of a sampler takes the samples: more than once for engines made for long arrays."""
        return 1

    @abstractmethod
    def sampler(self, case: Case, setting: Setting) -> Sampler | None:
        """A function that takes samples, ready to be timed; None if the engine cannot state the mechanism.

        Raises MissingPackageError if its package is not installed.
        """
