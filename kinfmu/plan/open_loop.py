"""The loop that does not close: the first block of the solving order without a closed pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import listed
from kinfmu.plan.equations.assembly import in_order
from kinfmu.plan.equations.closing import CLOSED, close
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.reach import cannot_close
from kinfmu.plan.equations.start_poses import StartValues
from kinfmu.plan.equations.system import Member, System

_RESTARTS = 12  # random poses of the bodies of a loop from which it may still close
_LESS_WEIGHT = 100.0  # of the rows of the open joint: the least squares nearly close the others
_LISTED = 8  # bodies and joints in a message


class OpenLoop(NamedTuple):
    """Bodies and rows that do not close although everything before them in the solving order does.

    bodies: names of the bodies that these rows place; owners: names of the joints and drivers that place them;
    joint: the one with the widest gap, the driver if the rows are drivers' alone; gap: that of this joint with the
    others of the loop closed, as a length or in radians; unit: of the gap; pose: (n,) coordinates with that gap, in
    which everything after the loop is closed as far as possible; closes_elsewhere: True if the loop closes from other
    poses of its bodies.
    """

    bodies: tuple[str, ...]
    owners: tuple[str, ...]
    joint: str
    gap: float
    unit: str
    pose: FloatArray
    closes_elsewhere: bool

    def __str__(self) -> str:
        one = len(self.bodies) == 1
        return (
            f"the loop of {'body' if one else 'bodies'} {_some(self.bodies)} with joints {_some(self.owners)} does not "
            f"close: gap {self.gap:.4g} {self.unit} at '{self.joint}' with the others closed"
        )


def find_open_loop(system: System, start: StartValues, kept: Sequence[int]) -> OpenLoop:
    """Return the first loop that does not close.

    Blocks are closed one by one in the solving order, as the plan solves them: a loop that depends on an open one is
    not blamed for it.

    Where rows and coordinates have no order, or each block closes alone, it is that of all rows.

    system: The equations of a mechanism that does not close. start: Its start values. kept: The independent joint rows,
    by index into System.rows; the drivers' rows are added.
    """
    everything = tuple(range(len(system.rows))), tuple(range(len(system.coordinates)))
    order = in_order(system, [*kept, *range(system.joint_row_count, len(system.rows))])
    blocks = () if order.unmatched_rows or order.unmatched_columns else order.blocks
    placed: list[int] = []
    q, found = start.q.copy(), None
    for rows, columns in blocks:
        at = q.copy()
        q[list(columns)], gap = close(Part(system, rows, columns, q), q[list(columns)], start.u)
        placed += rows if found is None else ()
        if gap > CLOSED and found is None:
            found = rows, columns
            closes_elsewhere = _closes_elsewhere(system, start.u, rows, columns, at)
            joint, q = _with_one_gap(system, start.u, rows, columns, q)
    if found is None:
        found, closes_elsewhere, placed = everything, False, list(everything[0])
        joint, q = _with_one_gap(system, start.u, *everything, close(system, start.q, start.u)[0])
    bodies = tuple(dict.fromkeys(system.coordinates[k].owner for k in found[1]))
    members = sorted({system.member_of[row] for row in placed})
    touching = [
        member.owner.name for member in map(system.members.__getitem__, members) if {*bodies} & {*member.bodies}
    ]
    gap, unit = _gap(system, q, start.u, joint)
    return OpenLoop(bodies, tuple(touching), joint.owner.name, gap, unit, q, closes_elsewhere)


def _with_one_gap(
    system: System, u: FloatArray, rows: Sequence[int], columns: Sequence[int], q: FloatArray
) -> tuple[Member, FloatArray]:
    """Return the joint of a loop with the widest gap, and the pose with the smallest gap there, the others closed.

    A loop without a joint's row, such as a bar set by a driver that cannot reach, gives the driver.
    """
    _, relative = _gaps(system, q, u)
    of_joints = [k for k in rows if k < system.joint_row_count]
    widest = system.members[system.member_of[max(of_joints or rows, key=lambda k: relative[k])]]
    is_open = np.array([k in widest.rows for k in rows])
    loop = Part(system, rows, columns, q)
    loop.row_scales = np.where(is_open, _LESS_WEIGHT, 1.0) * loop.row_scales
    near, _ = close(loop, q[list(columns)], u)
    others = [k for k, opened in zip(rows, is_open, strict=True) if not opened]
    q = q.copy()
    q[list(columns)] = close(Part(system, others, columns, q), near, u)[0] if others else near
    return widest, q


def _closes_elsewhere(
    system: System, u: FloatArray, rows: Sequence[int], columns: Sequence[int], at: FloatArray
) -> bool:
    """Return True if a loop closes from one of some random poses of its bodies."""
    rng = np.random.default_rng(1989)
    part, width = Part(system, rows, columns, at), np.pi * system.column_scales[list(columns)]
    if cannot_close(part, u):
        return False
    starts = (at[list(columns)] + width * rng.uniform(-1.0, 1.0, len(columns)) for _ in range(_RESTARTS))
    return any(close(part, rough, u)[1] <= CLOSED for rough in starts)


def _gap(system: System, q: FloatArray, u: FloatArray, member: Member) -> tuple[float, str]:
    """Return the gap of a joint or driver and its unit: of its rows of the kind of the widest one."""
    gaps, relative = _gaps(system, q, u)
    worst = max(member.rows, key=lambda k: relative[k])
    same = [k for k in member.rows if system.rows[k].kind == system.rows[worst].kind]
    return math.hypot(*(gaps[k] for k in same)), system.gap_unit(system.rows[worst])


def _gaps(system: System, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the gap of each row as a length or in radians, (m,), and its absolute value, lengths over the size."""
    gaps = np.concatenate((system.gaps(system.residual(q, u)), system.measure(q) - u))
    sizes = np.array([1.0 if row.kind == "angle" else system.size for row in system.rows])
    return gaps, np.abs(gaps) / sizes


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return listed(names[:_LISTED]) + more
