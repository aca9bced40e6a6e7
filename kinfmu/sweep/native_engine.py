"""The native engine: whole arrays of samples through the compiled C of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kinfmu.plan import SolvePlan
from kinfmu.run import FloatArray
from kinfmu.sweep.engine import Driven, SweepResult, Tables
from kinfmu.sweep.library import Library


class NativeEngine:
    """A plan's library. parameters: values reached from those of the plan, or nothing; fixed: as Engine has it.

    CompilerError if there is no compiler, or if the library cannot be compiled, kept or loaded.
    """

    name = "native"
    order: Literal["C", "F"] = "F"

    def __init__(
        self, plan: SolvePlan, parameters: Sequence[float], fixed: Mapping[str, float], tolerance: float
    ) -> None:
        self._library = Library(plan)
        self._parameters = parameters
        self._tolerance = tolerance
        self.fixed = fixed

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Driver values, speeds and accelerations at times, by the laws."""
        return self._library.drive(times, constants, self._parameters)

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables; what cannot be reached is NaN there."""
        plain = all(
            table.flags.aligned and all(stride > 0 and stride % 8 == 0 for stride in table.strides) for table in tables
        )
        filled = tables if plain else [np.empty(table.shape, order="F") for table in tables]
        told = self._library.sweep(driven, filled, self._parameters, self._tolerance)
        for table, values in zip(tables, filled, strict=True):
            if table is not values:
                table[:] = values
        late = _LazyDiagnostics(self._library, driven, told.outcomes, self._parameters, self._tolerance)
        return SweepResult(
            status=told.outcomes[:, 0].astype(np.int64),
            iterations=told.outcomes[:, 1].astype(np.int64),
            residual=told.residual,
            watch=told.watch,
            margin=lambda: late.diagnosed[0],
            error=lambda: late.diagnosed[1],
            failures=told.failures,
        )


class _LazyDiagnostics:
    """Margins and errors of a sweep, which are computed together when either is first read."""

    def __init__(
        self,
        library: Library,
        driven: Driven,
        outcomes: NDArray[np.int32],
        parameters: Sequence[float],
        tolerance: float,
    ) -> None:
        self._library = library
        self._driven = driven
        self._outcomes = outcomes
        self._parameters = parameters
        self._tolerance = tolerance

    @cached_property
    def diagnosed(self) -> tuple[FloatArray, FloatArray]:
        return self._library.diagnose(self._driven, self._outcomes, self._parameters, self._tolerance)
