"""Part of a system: some of its rows over some of its coordinates; the others do not move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.system import Member, System


class Part:
    """Rows of a system over some of its coordinates; only the joints and drivers of these rows are evaluated.

    rows, columns: by index into System.rows and System.coordinates, all if None; at: (n,) values of the other
    coordinates. q here is (len(columns),).
    """

    def __init__(
        self,
        system: System,
        rows: Sequence[int] | None = None,
        columns: Sequence[int] | None = None,
        at: FloatArray | None = None,
    ) -> None:
        self.system = system
        n = len(system.coordinates)
        self.rows = list(range(len(system.rows)) if rows is None else rows)
        self.columns = list(range(n) if columns is None else columns)
        self.row_scales: FloatArray = system.scales[self.rows] * system.size  # residual per mechanism size
        self.column_scales: FloatArray = system.column_scales[self.columns]
        self._at = np.zeros(n) if at is None else at.copy()
        row_place = {row: k for k, row in enumerate(self.rows)}
        column_place = {column: k for k, column in enumerate(self.columns)}
        self._members = [
            _PartMember(system.members[number], row_place, column_place, self._at)
            for number in sorted({system.member_of[row] for row in self.rows})
        ]

    def whole(self, q: FloatArray) -> FloatArray:
        """Return all coordinates of the system, (n,)."""
        at = self._at.copy()
        at[self.columns] = q
        return at

    def residual(self, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return Phi of the rows relative to the size, (len(rows),)."""
        pose, phi = q.tolist(), np.empty(len(self.rows))
        for part in self._members:
            values = self.system.values(part.member, part.coordinates(pose), u)
            for k, place in part.rows:
                phi[place] = values[k]
        return np.asarray(phi / self.row_scales)

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Return Phi_q, rows relative to the size and columns in sizes and radians: pure numbers of order one."""
        pose, matrix = q.tolist(), np.zeros((len(self.rows), len(self.columns)))
        for part in self._members:
            gradients = self.system.gradients(part.member, part.coordinates(pose))
            for k, row in part.rows:
                for j, column in part.columns:
                    matrix[row, column] = gradients[k, j]
        return matrix / self.row_scales[:, None] * self.column_scales


class _PartMember:
    """A joint or driver of a part.

    rows, columns: those of its own that are of the part, by index, each with its place there.
    """

    def __init__(
        self, member: Member, row_place: Mapping[int, int], column_place: Mapping[int, int], at: FloatArray
    ) -> None:
        self.member = member
        self.rows = [(k, row_place[row]) for k, row in enumerate(member.rows) if row in row_place]
        self.columns = [(k, column_place[column]) for k, column in enumerate(member.columns) if column in column_place]
        self._at = member.coordinates(at)

    def coordinates(self, pose: Sequence[float]) -> list[float]:
        """Return its coordinates from those of the part."""
        at: list[float] = self._at.copy()
        for k, place in self.columns:
            at[k] = pose[place]
        return at
