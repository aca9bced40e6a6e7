"""What an engine tells of the samples of a sweep, besides the tables that it fills."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

from kinfmu.run import FloatArray, IntArray

Driven = tuple[FloatArray, FloatArray, FloatArray]  # (n, d) values, speeds and accelerations of the drivers
Tables = tuple[FloatArray, FloatArray, FloatArray]  # (n, m) values, rates and accelerations of the outputs


class SweepResult(NamedTuple):
    """Arrays as in Run; margin and error as functions that compute them. failures: the first sample of each stretch
    without numbers, and why.
    """

    status: IntArray
    iterations: IntArray
    residual: FloatArray
    watch: FloatArray
    margin: Callable[[], FloatArray]
    error: Callable[[], FloatArray]
    failures: tuple[tuple[int, str], ...]


class Engine(Protocol):
    """Something that solves a plan at many samples. order: how it likes its tables; fixed: what never moves."""

    name: str
    order: Literal["C", "F"]
    fixed: Mapping[str, float]

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Driver values, speeds and accelerations at times, by the laws."""

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables; what cannot be reached is NaN there."""
