"""Engines: per-sample diagnostics of a sweep, and what every engine can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

from kinfmu.errors import KinfmuError
from kinfmu.run import FloatArray, IntArray

Driven = tuple[FloatArray, FloatArray, FloatArray]  # (n, d) values, speeds and accelerations of the drivers
Tables = tuple[FloatArray, FloatArray, FloatArray]  # (n, m) values, rates and accelerations of the outputs


class UnreachedError(KinfmuError):
    """Parameters, or the start of the laws with them, that continuation from the anchor does not reach."""


class SweepResult(NamedTuple):
    """Per-sample diagnostics as in Run, as functions that return them.

    failures: the first sample of each interval without numbers, and the reason.
    """

    status: Callable[[], IntArray]
    iterations: Callable[[], IntArray]
    residual: Callable[[], FloatArray]
    watch: Callable[[], FloatArray]
    margin: Callable[[], FloatArray]
    error: Callable[[], FloatArray]
    failures: tuple[tuple[int, str], ...]


class Engine(Protocol):
    """A solver of a plan at many samples. order: of the fastest tables; fixed: coordinates that never move."""

    name: str
    order: Literal["C", "F"]

    @property
    def fixed(self) -> Mapping[str, float]: ...

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""
