"""The matrices of the method: Jacobians, plain and row-reduced, at the poses of a report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.analysis.singular import DriverRange
from kinfmu.analysis.values import driver_text
from kinfmu.arrays import FloatArray
from kinfmu.errors import listed
from kinfmu.plan import SolvePlan, localized
from kinfmu.plan.equations.assembly import find_assembly
from kinfmu.plan.equations.closing import close
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.system import System
from kinfmu.plan.origin import relative_to
from kinfmu.run.solve import solve

SMALL_TURN = math.radians(1.0)  # [rad]; enough to restore the rank near a singular point
_ZERO = 1e-7  # part of the largest entry; smaller counts as zero: a dead centre, a double root, has half the digits


@dataclass(frozen=True)
class Matrix:
    """A Jacobian at a pose: rows and columns by name, its rank and its row-reduced form."""

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    entries: FloatArray  # (m, n)

    @property
    def reduced(self) -> FloatArray:
        """Row-reduced echelon form, (m, n)."""
        return row_reduced(self.entries)

    @property
    def rank(self) -> int:
        return int(np.any(np.abs(self.reduced) > 0.0, axis=1).sum())

    def as_json(self) -> dict[str, Any]:
        """Return the matrix as plain data."""
        return {
            "title": self.title,
            "rows": list(self.rows),
            "columns": list(self.columns),
            "entries": self.entries.tolist(),
            "reduced": self.reduced.tolist(),
            "rank": self.rank,
        }

    def __str__(self) -> str:
        head = f"{self.title}: {len(self.rows)} x {len(self.columns)}, rank {self.rank}"
        plain = _table(self.rows, self.columns, self.entries)
        return "\n".join([head, plain, "row-reduced", _table(None, self.columns, self.reduced)])


def pose_matrices(plan: SolvePlan, redundancy: Redundancy, reach: DriverRange | None) -> tuple[Matrix, ...]:
    """Return Phi_K,q and Phi_q at the assembled pose, Phi_q at each singular point and after a small turn."""
    system = System(localized(plan.mechanism)[0])
    assembled = find_assembly(system).pose
    moving = [name for name in system.coordinates if name not in plan.fixed]
    if assembled is None or not moving:
        return ()
    joint_rows = list(range(system.joint_row_count))
    driving = list(range(system.joint_row_count, len(system.rows)))
    solved = [*redundancy.kept, *driving]
    start = _at(plan, assembled.u)
    matrices = [_moving_jacobian(system, assembled.q, joint_rows, moving, f"Phi_K,q at {start}")]
    matrices.append(_moving_jacobian(system, assembled.q, solved, moving, f"Phi_q at {start}"))
    for point in reach.points if reach else ():
        near = point.value + SMALL_TURN
        if reach and reach.high is not None and near > reach.high:
            near = point.value - SMALL_TURN
        for value, note in ((point.value, "singular point"), (near, "after a small turn")):
            q = _pose(system, plan, value)
            if q is not None:
                matrices.append(_moving_jacobian(system, q, solved, moving, f"Phi_q at {_at(plan, [value])}, {note}"))
    return tuple(matrices)


def _at(plan: SolvePlan, u: Iterable[float]) -> str:
    """Return driver values for a title, such as 'crank = pi/3 (60 deg)'."""
    unit, drivers = plan.mechanism.length_unit, plan.mechanism.drivers
    return listed(driver_text(driver, float(value), unit) for driver, value in zip(drivers, u, strict=True))


def _pose(system: System, plan: SolvePlan, value: float) -> FloatArray | None:
    """Return all coordinates at a driver value; at a limit, closed from a pose just before it."""
    driver = plan.drivers[0]
    for nearer in (0.0, 1e-9, -1e-9):
        asked: dict[str, Any] = {driver.inputs[0]: [value + nearer]}
        run = solve(plan, **asked)
        if run.good[0]:
            q = relative_to(plan.origin, system.coordinates, {name: run[name][0] for name in system.coordinates})
            return q if nearer == 0.0 else close(system, q, np.array([value]))[0]
    return None


def _moving_jacobian(system: System, q: FloatArray, rows: Sequence[int], columns: Sequence[str], title: str) -> Matrix:
    """Return Phi_q of the chosen rows and coordinates, without rows that do not depend on them."""
    places = [system.coordinates.index(name) for name in columns]
    entries = system.jacobian(q)[np.ix_(list(rows), places)]
    meets = [k for k, row in enumerate(entries) if np.abs(row).max(initial=0.0) > 0.0]
    names = tuple(system.rows[rows[k]].name for k in meets)
    return Matrix(title, names, tuple(columns), entries[meets])


def row_reduced(matrix: FloatArray) -> FloatArray:
    """Return the reduced row echelon form by Gauss-Jordan with partial pivoting; rounding errors become zero."""
    a = np.array(matrix, dtype=float)
    small = _ZERO * np.abs(a).max(initial=0.0)
    top = 0
    for column in range(a.shape[1]):
        if top == a.shape[0]:
            break
        pivot = top + int(np.abs(a[top:, column]).argmax())
        if abs(a[pivot, column]) <= small:
            a[top:, column] = 0.0
            continue
        a[[top, pivot]] = a[[pivot, top]]
        a[top] /= a[top, column]
        others = [k for k in range(a.shape[0]) if k != top]
        a[others] -= np.outer(a[others, column], a[top])
        top += 1
    a[np.abs(a) <= small] = 0.0
    return a


def _table(rows: Sequence[str] | None, columns: Sequence[str], entries: FloatArray) -> str:
    width = max([10, *(len(name) + 2 for name in columns)])
    label = max((len(name) for name in rows or ()), default=0) + 2
    lines = [" " * label + "".join(name.rjust(width) for name in columns)]
    for k, row in enumerate(entries):
        name = rows[k] if rows else ""
        lines.append(name.ljust(label) + "".join(f"{value:{width}.4f}" for value in np.round(row, 4) + 0.0))
    return "\n".join(lines)
