"""Margins and estimated errors of a run that holds none, solved at its driver values when they are read."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError
from kinfmu.run import Run
from kinfmu.solver.python.solver import TOLERANCE

COST = 4  # of a sample with its estimates, in samples without
SAME_POSE = 1e-6  # [rad, sizes]; a pose that differs by more has another margin


def with_estimates(run: Run) -> Run:
    """Return the run with margins and errors that are computed from its mechanism and driver values when read.

    They are NaN where the mechanism cannot be solved there. An error is at least the difference of the run's numbers
    from those solved again.
    """

    @cache
    def both() -> tuple[FloatArray, FloatArray]:
        return _estimates(run)

    return run.replaced(margin=lambda: both()[0], error=lambda: both()[1])


def _estimates(run: Run) -> tuple[FloatArray, FloatArray]:
    """Return margins (n,) and estimated errors (n, 3)."""
    from kinfmu.run.solve import kept_model  # a record is written and read without the planner

    margin, error = np.full(len(run), np.nan), np.full((len(run), 3), np.nan)
    rows = np.flatnonzero(run.good)
    try:
        if run.mechanism is None or not len(rows):
            return margin, error
        outputs = tuple(map(str, run.outputs))
        model = kept_model(run.mechanism, outputs, (), "auto")
        if model.is_native(COST * len(rows)):
            model = kept_model(run.mechanism, outputs, (), "native")
        inputs: dict[str, Any] = dict(zip(run.input_names, run.inputs[rows].T, strict=True))
        closed = max(
            np.max(gaps, initial=TOLERANCE, where=np.isfinite(gaps)) for gaps in (run.residual, abs(run.watch))
        )
        again = model.solve(tolerance=2.0 * float(closed), **inputs)  # what the run's own tolerance allowed
    except KinfmuError:
        return margin, error
    scales = np.array([1.0 if name.is_angle else model.plan.size for name in run.outputs])
    for k, table in enumerate(("values", "rates", "accelerations")):
        apart = np.abs(getattr(again, table) - getattr(run, table)[rows]) / scales
        apart = np.max(apart, axis=1, initial=0.0, where=np.isfinite(apart))  # columns that were not kept are NaN
        error[rows, k] = np.maximum(again.error[:, k], apart)
        if k == 0:
            margin[rows] = np.where(apart <= SAME_POSE, again.margin, np.nan)
    return margin, error
