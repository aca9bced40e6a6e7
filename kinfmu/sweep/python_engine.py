"""The Python engine: samples one after another through the generated Python of a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from kinfmu.run import FloatArray
from kinfmu.solver.python import Solver
from kinfmu.solver.python.pose import Vector
from kinfmu.sweep.engine import Driven, Swept, Tables
from kinfmu.sweep.pose_history import Kept

_GAP = float("nan")


class PythonEngine:
    """Follows each sample from the last good one."""

    name = "python"
    order: Literal["C", "F"] = "C"

    def __init__(self, solver: Solver) -> None:
        self._solver = solver
        self.fixed: Mapping[str, float] = solver.model.FIXED

    def drive(self, times: FloatArray, constants: Sequence[float]) -> Driven:
        """Driver values, speeds and accelerations at times, by the laws."""
        model, values = self._solver.model, tuple(constants)
        driven = np.array([model.drive(t, values) for t in times.tolist()], dtype=float)  # (n, 3, d)
        driven = driven.reshape(len(times), 3, len(model.DRIVERS))
        return driven[:, 0], driven[:, 1], driven[:, 2]

    def sweep(self, driven: Driven, tables: Tables) -> Swept:
        """Fill the tables; what cannot be reached is NaN there."""
        solver = self._solver
        n, m = tables[0].shape
        watch_count = len(solver.model.WATCHES)
        gap: Vector = (_GAP,) * (3 * m)
        motions: list[Vector] = []
        told, watches, failures = [], [], []
        kept = Kept(solver, driven)
        good, failing = solver.anchor, False
        for k, (u, ud, udd) in enumerate(zip(*(map(tuple, table.tolist()) for table in driven), strict=True)):
            pose = solver.solve(good, u)
            kept.add(pose)
            if pose.good:
                good, failing = pose, False
                told.append((pose.status, pose.residual, pose.iterations))
                motions.append(solver.motion(pose, ud, udd))
                watches.append(solver.watch(pose))
            else:
                if not failing:
                    failures.append((k, pose.message))
                failing = True
                told.append((pose.status, _GAP, 0))
                motions.append(gap)
                watches.append((_GAP,) * watch_count)
        whole = np.array(motions, dtype=float).reshape(n, 3, m)
        for k, array in enumerate(tables):
            array[:] = whole[:, k]
        diagnostics = np.array(told, dtype=float).reshape(n, 3)
        return Swept(
            status=diagnostics[:, 0].astype(np.int64),
            iterations=diagnostics[:, 2].astype(np.int64),
            residual=diagnostics[:, 1],
            watch=np.array(watches, dtype=float).reshape(n, watch_count),
            margin=kept.margins,
            error=kept.errors,
            failures=tuple(failures),
        )
