"""Part of a system: some of its rows over some of its coordinates; the others do not move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.plan.equations.system import System


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
        row_place, column_place = _places(self.rows, len(system.rows)), _places(self.columns, n)
        self._members = []  # (member, its rows wanted and their places, its entries of Phi_q wanted and their places)
        for number in sorted({system.member_of[row] for row in self.rows}):
            member = system.members[number]
            wanted_rows = [k for k, row in enumerate(member.rows) if row_place[row] >= 0]
            wanted_columns = [k for k, column in enumerate(member.columns) if column_place[column] >= 0]
            row_places = row_place[[member.rows[k] for k in wanted_rows]]
            column_places = column_place[[member.columns[k] for k in wanted_columns]]
            entries = np.ix_(wanted_rows, wanted_columns), np.ix_(row_places, column_places)
            self._members.append((member, (wanted_rows, row_places), entries))

    def whole(self, q: FloatArray) -> FloatArray:
        """Return all coordinates of the system, (n,)."""
        at = self._at.copy()
        at[self.columns] = q
        return at

    def residual(self, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return Phi of the rows relative to the size, (len(rows),)."""
        at, phi = self.whole(q), np.empty(len(self.rows))
        for member, (rows, places), _ in self._members:
            values = self.system.values(member, at, u)
            phi[places] = [values[k] for k in rows]
        return np.asarray(phi / self.row_scales)

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Return Phi_q, rows relative to the size and columns in sizes and radians: pure numbers of order one."""
        at, matrix = self.whole(q), np.zeros((len(self.rows), len(self.columns)))
        for member, _, (entries, places) in self._members:
            matrix[places] = self.system.gradients(member, at)[entries]
        return matrix / self.row_scales[:, None] * self.column_scales


def _places(chosen: Sequence[int], count: int) -> np.ndarray:
    """Return the place of each of `count` indices among those chosen, -1 for the others."""
    places = np.full(count, -1)
    places[list(chosen)] = np.arange(len(chosen))
    return places
