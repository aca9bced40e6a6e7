"""Kept: the poses of a run, for what is told of them only when it is read."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinfmu.run import FloatArray
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Vector, evaluated


class Kept:
    """Poses of the samples of a run, as the unknowns that they were found with; a bridge's poses as they are.

    driven: u, ud, udd of the drivers, (n, d) each.
    """

    def __init__(self, solver: Solver, driven: tuple[FloatArray, FloatArray, FloatArray]) -> None:
        self._solver = solver
        self._driven = driven
        self._found: list[Pose | Vector | None] = []

    def add(self, pose: Pose) -> None:
        """The next sample's pose."""
        self._found.append(
            None if not pose.good else pose if pose.bridge is not None or (pose.tracks and pose.status) else pose.z
        )

    def margins(self) -> FloatArray:
        """(n,) margin of each sample, NaN where it holds no numbers."""
        table = np.full(len(self._found), np.nan)
        for k, pose, _, _ in self._poses():
            table[k] = self._solver.margin(pose)
        return table

    def errors(self) -> FloatArray:
        """(n, 3) estimated errors of q, qd, qdd of each sample, NaN where it holds no numbers."""
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
