"""The native engine: whole arrays of samples through the compiled C of a plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Literal

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.run.engine import Driven, SweepResult, Tables
from kinfmu.run.library import Library


class NativeEngine:
    """The engine of a plan's compiled library.

    Args:
        library: The compiled plan.
        parameters: Values to set by continuation from those of the plan; empty: those of the plan.
        fixed: Returns the coordinates that never move, by name.
        tolerance: Residual relative to the size above which a sample is not ok.

    """

    name = "native"
    order: Literal["C", "F"] = "F"

    def __init__(
        self, library: Library, parameters: Sequence[float], fixed: Callable[[], Mapping[str, float]], tolerance: float
    ) -> None:
        self._library = library
        self._parameters = parameters
        self._tolerance = tolerance
        self._fixed = fixed

    @property
    def fixed(self) -> Mapping[str, float]:
        return self._fixed()

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""
        return self._library.drive(times, constants, self._parameters)

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""
        plain = all(map(_is_plain, tables))
        filled = tables if plain else [np.empty(table.shape, order="F") for table in tables]
        result = self._library.sweep(driven, filled, self._parameters, self._tolerance)
        if not plain:
            for table, values in zip(tables, filled, strict=True):
                table[:] = values
        diagnosis = _Diagnosis(
            lambda: self._library.diagnose(driven, result.outcomes, self._parameters, self._tolerance)
        )
        return SweepResult(
            status=lambda: result.outcomes[:, 0].astype(np.int64),
            iterations=lambda: result.outcomes[:, 1].astype(np.int64),
            residual=lambda: result.residual,
            watch=lambda: result.watch,
            margin=lambda: diagnosis.both[0],
            error=lambda: diagnosis.both[1],
            failures=result.failures,
        )


class _Diagnosis:
    """Margins and errors of a sweep: both are computed when either is first read."""

    def __init__(self, compute: Callable[[], tuple[FloatArray, FloatArray]]) -> None:
        self._compute = compute

    @cached_property
    def both(self) -> tuple[FloatArray, FloatArray]:
        return self._compute()


def _is_plain(table: FloatArray) -> bool:
    """Return whether the engine can fill a table: places and strides are whole numbers, and the strides positive."""
    flags = table.flags
    return flags.aligned and (flags.f_contiguous or all(stride > 0 and stride % 8 == 0 for stride in table.strides))
