"""The matrices of the method at the poses of a report."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from kinfmu.analysis.matrices import Matrix, moving_jacobian
from kinfmu.analysis.singular import DriverRange
from kinfmu.analysis.values import value_text
from kinfmu.equations.assembly import find_assembly
from kinfmu.equations.closing import close
from kinfmu.equations.redundancy import Redundancy
from kinfmu.equations.system import FloatArray, System
from kinfmu.errors import listed
from kinfmu.plan import SolvePlan, localized
from kinfmu.plan.origin import relative_to
from kinfmu.sweep import solve

SMALL_TURN = math.radians(1.0)  # [rad]; enough to restore the rank near a singular point


def pose_matrices(plan: SolvePlan, redundancy: Redundancy, reach: DriverRange | None) -> tuple[Matrix, ...]:
    """Return Phi_K,q and Phi_q at the start pose, Phi_q at each singular point of the range and after a small turn."""
    system = System(localized(plan.mechanism)[0])
    assembled = find_assembly(system).pose
    moving = [name for name in system.coordinates if name not in plan.fixed]
    if assembled is None or not moving:
        return ()
    joint_rows = list(range(system.joint_row_count))
    driving = list(range(system.joint_row_count, len(system.rows)))
    solved = [*redundancy.kept, *driving]
    start = _at(plan, assembled.u)
    matrices = [moving_jacobian(system, assembled.q, joint_rows, moving, f"Phi_K,q at {start}")]
    matrices.append(moving_jacobian(system, assembled.q, solved, moving, f"Phi_q at {start}"))
    for point in reach.points if reach else ():
        near = point.value + SMALL_TURN
        if reach and reach.high is not None and near > reach.high:
            near = point.value - SMALL_TURN
        for value, note in ((point.value, "singular point"), (near, "after a small turn")):
            q = _pose(system, plan, value)
            if q is not None:
                matrices.append(moving_jacobian(system, q, solved, moving, f"Phi_q at {_at(plan, [value])}, {note}"))
    return tuple(matrices)


def _at(plan: SolvePlan, u: Iterable[float]) -> str:
    """Return driver values for a title, such as 'crank = pi/3 (60 deg)'."""
    unit, drivers = plan.mechanism.length_unit, plan.mechanism.drivers
    return listed(f"{d.name} = {value_text(float(v), unit, d.quantity.kind)}" for d, v in zip(drivers, u, strict=True))


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
