"""The Python engine: samples one after another through the generated Python of a plan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.run.engine import Driven, SweepResult, Tables
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Vector, evaluated

_GAP = float("nan")


class PoseHistory:
    """The poses of a run's samples, kept as their unknowns; poses of bridges are kept whole.

    driven: u, ud, udd of the drivers, (n, d) each.
    """

    def __init__(self, solver: Solver, driven: tuple[FloatArray, FloatArray, FloatArray]) -> None:
        self._solver = solver
        self._driven = driven
        self._found: list[Pose | Vector | None] = []

    def add(self, pose: Pose) -> None:
        """Add the good pose of the next sample."""
        self._found.append(pose if pose.bridge is not None or (pose.tracks and pose.status) else pose.z)

    def add_gap(self) -> None:
        """Add a sample without numbers."""
        self._found.append(None)

    def margins(self) -> FloatArray:
        """Return (n,) margins; NaN for samples without numbers."""
        table = np.full(len(self._found), np.nan)
        for k, pose, _, _ in self._poses():
            table[k] = self._solver.margin(pose)
        return table

    def errors(self) -> FloatArray:
        """Return (n, 3) estimated errors of q, qd, qdd; NaN for samples without numbers."""
        table = np.full((len(self._found), 3), np.nan)
        for k, pose, ud, udd in self._poses():
            table[k] = self._solver.errors(pose, ud, udd)
        return table

    def _poses(self) -> Iterator[tuple[int, Pose, Vector, Vector]]:
        model = self._solver.model
        samples = zip(self._found, *(map(tuple, table.tolist()) for table in self._driven), strict=True)
        for k, (found, u, ud, udd) in enumerate(samples):
            if found is not None:
                yield k, found if isinstance(found, Pose) else Pose(u, evaluated(model, u, found)), ud, udd


class PythonEngine:
    """The engine that follows each sample from the last good one by the generated Python."""

    name = "python"
    order: Literal["C", "F"] = "C"

    def __init__(self, solver: Solver) -> None:
        self._solver = solver
        self.fixed: Mapping[str, float] = solver.model.FIXED

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Return driver values, speeds and accelerations at times, by the laws."""
        model, values = self._solver.model, tuple(constants)
        driven = np.array([model.drive(t, values) for t in times.tolist()], dtype=float)  # (n, 3, d)
        driven = driven.reshape(len(times), 3, len(model.DRIVERS))
        return driven[:, 0], driven[:, 1], driven[:, 2]

    def sweep(self, driven: Driven, tables: Tables) -> SweepResult:
        """Fill the tables, with NaN for samples that cannot be reached, and return the diagnostics."""
        solver = self._solver
        n, m = tables[0].shape
        watch_count = len(solver.model.WATCHES)
        gap: Vector = (_GAP,) * (3 * m)
        motions: list[Vector] = []
        outcomes: list[Vector] = []
        watches: list[Vector] = []
        failures = []
        history = PoseHistory(solver, driven)
        good, failing = solver.anchor, False
        for k, (u, ud, udd) in enumerate(zip(*(map(tuple, table.tolist()) for table in driven), strict=True)):
            pose = solver.solve(good, u)
            if pose.good:
                good, failing = pose, False
                history.add(pose)
                outcomes.append((pose.status, pose.residual, pose.iterations))
                motions.append(solver.motion(pose, ud, udd))
                if watch_count:
                    watches.append(solver.watch(pose))
            else:
                history.add_gap()
                if not failing:
                    failures.append((k, pose.message))
                failing = True
                outcomes.append((pose.status, _GAP, 0))
                motions.append(gap)
                watches.append((_GAP,) * watch_count)
        whole = np.array(motions, dtype=float).reshape(n, 3, m)
        for k, array in enumerate(tables):
            array[:] = whole[:, k]
        return SweepResult(
            status=lambda: np.array([status for status, _, _ in outcomes], dtype=np.int64),
            iterations=lambda: np.array([iterations for _, _, iterations in outcomes], dtype=np.int64),
            residual=lambda: np.array([residual for _, residual, _ in outcomes], dtype=float),
            watch=lambda: np.array(watches, dtype=float).reshape(n, watch_count),
            margin=history.margins,
            error=history.errors,
            failures=tuple(failures),
        )
