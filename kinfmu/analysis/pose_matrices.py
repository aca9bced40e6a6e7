"""The matrices of the method at the poses that a report tells of."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from kinfmu.analysis.matrices import Matrix, moving_jacobian
from kinfmu.analysis.singular import DriverRange
from kinfmu.analysis.written import written
from kinfmu.equations.assembly import assemble
from kinfmu.equations.closing import close
from kinfmu.equations.redundancy import Redundancy
from kinfmu.equations.system import FloatArray, System
from kinfmu.errors import listed
from kinfmu.plan import SolvePlan, localized
from kinfmu.sweep import solve

SMALL_TURN = math.radians(1.0)  # [rad]; what restores the rank at a singular point


def pose_matrices(plan: SolvePlan, redundancy: Redundancy, reach: DriverRange | None) -> tuple[Matrix, ...]:
    """Phi_K,q and Phi_q at the start pose, Phi_q at each singular point of the range and a small turn beside it."""
    system = System(localized(plan.mechanism)[0])
    assembled = assemble(system)
    moving = [name for name in system.coordinates if name not in plan.fixed]
    if assembled is None or not moving:
        return ()
    joint_rows = list(range(system.joint_row_count))
    driving = list(range(system.joint_row_count, len(system.rows)))
    solved = [*redundancy.kept, *driving]
    start = _at(plan, assembled.u)
    told = [moving_jacobian(system, assembled.q, joint_rows, moving, f"Phi_K,q at {start}")]
    told.append(moving_jacobian(system, assembled.q, solved, moving, f"Phi_q at {start}"))
    for point in reach.points if reach else ():
        beside = point.value + SMALL_TURN
        if reach and reach.high is not None and beside > reach.high:
            beside = point.value - SMALL_TURN
        for value, note in ((point.value, "singular point"), (beside, "a small turn beside it")):
            q = _pose(system, plan, value)
            if q is not None:
                told.append(moving_jacobian(system, q, solved, moving, f"Phi_q at {_at(plan, [value])}, {note}"))
    return tuple(told)


def _at(plan: SolvePlan, u: Iterable[float]) -> str:
    """'crank = pi/3 (60 deg)': driver values for a title."""
    unit, drivers = plan.mechanism.length_unit, plan.mechanism.drivers
    return listed(f"{d.name} = {written(float(v), unit, d.quantity.kind)}" for d, v in zip(drivers, u, strict=True))


def _pose(system: System, plan: SolvePlan, value: float) -> FloatArray | None:
    """All coordinates at a driver value, exactly at a limit too: closed from the pose a little before it."""
    driver = plan.drivers[0]
    for nearer in (0.0, 1e-9, -1e-9):
        asked: dict[str, Any] = {driver.inputs[0]: [value + nearer]}
        run = solve(plan, **asked)
        if run.good[0]:
            offset = {"x": plan.origin.x, "y": plan.origin.y, "phi": 0.0}
            q = np.array([run[name][0] - offset[name.rpartition(".")[2]] for name in system.coordinates])
            return q if nearer == 0.0 else close(system, q, np.array([value]))[0]
    return None
