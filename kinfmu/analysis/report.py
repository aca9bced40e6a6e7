"""check(): what a good colleague would say about a mechanism."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.analysis.matrices import Matrix, moving_jacobian
from kinfmu.analysis.singular import DriverRange, SingularPoint, driver_range, multiple_of_pi, written
from kinfmu.equations.assembly import assemble, close
from kinfmu.equations.system import FloatArray, System
from kinfmu.errors import KinfmuError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.plan import SolvePlan, determinant_formula, localized, plan_from
from kinfmu.redundancy import DependentRow, Redundancy, find_redundancy
from kinfmu.sweep import solve

SMALL_TURN = math.radians(1.0)  # [rad]; what restores the rank at a singular point


@dataclass(frozen=True)
class BlockReport:
    """A block of the plan: what it solves for, from which rows, and its determinant where that is a short formula."""

    unknowns: tuple[str, ...]
    rows: tuple[str, ...]
    determinant: str | None


@dataclass(frozen=True)
class Report:
    """Findings of a check. `problem` says why the mechanism cannot be solved, None if it can."""

    mechanism: Mechanism
    redundancy: Redundancy
    problem: KinfmuError | None
    plan: SolvePlan | None
    range: DriverRange | None

    @property
    def mobility(self) -> int:
        """Coordinates less independent joint rows."""
        return self.redundancy.mobility

    @property
    def gruebler(self) -> int:
        """Mobility by Gruebler's count, which does not see redundancy: coordinates less joint rows."""
        return len(self.mechanism.coordinate_names) - sum(len(joint.labels) for joint in self.mechanism.joints)

    @property
    def redundant(self) -> tuple[DependentRow, ...]:
        return self.redundancy.redundant

    @property
    def inconsistent(self) -> tuple[DependentRow, ...]:
        return self.redundancy.inconsistent

    @property
    def singular(self) -> tuple[SingularPoint, ...]:
        """Singular points over a turn of the driver."""
        return self.range.points if self.range else ()

    @property
    def blocks(self) -> tuple[BlockReport, ...]:
        """Blocks that need Newton, in the order of solving."""
        if self.plan is None:
            return ()
        return tuple(
            BlockReport(block.unknowns, block.row_names, determinant_formula(block))
            for block in self.plan.blocks
            if block.unknowns
        )

    def as_json(self) -> dict[str, Any]:
        """The findings as plain data."""
        plan = self.plan
        return {
            "name": self.mechanism.name,
            "bodies": [body.name for body in self.mechanism.moving_bodies],
            "rows": sum(len(joint.labels) for joint in self.mechanism.joints),
            "mobility": self.mobility,
            "gruebler": self.gruebler,
            "drivers": [driver.name for driver in self.mechanism.drivers],
            "redundant": [_row_json(row) for row in self.redundant],
            "inconsistent": [_row_json(row) for row in self.inconsistent],
            "coordinates": list(plan.coordinates) if plan else [],
            "outputs": list(plan.outputs) if plan else [],
            "fixed": dict(plan.fixed) if plan else {},
            "blocks": [
                {"unknowns": list(b.unknowns), "rows": list(b.rows), "determinant": b.determinant} for b in self.blocks
            ],
            "singular": [{"value": p.value, "kind": p.kind, "block": p.block} for p in self.singular],
            "range": [self.range.low, self.range.high] if self.range else None,
            "problem": str(self.problem) if self.problem else None,
        }

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def matrices(self) -> tuple[Matrix, ...]:
        """The report's matrices: Phi_K,q at the start pose, Phi_q at each singular point and a small turn beside it."""
        if self.plan is None:
            raise self.problem or KinfmuError("there is no plan, so there are no matrices")
        return _matrices(self, self.plan)


def check(mechanism: Mechanism) -> Report:
    """Mobility, redundant and inconsistent rows, plan, singular points and range of a mechanism.

    Faults of the mechanism do not raise; they stand in the report's `problem`.
    """
    local, origin = localized(mechanism)
    system = System(local)
    redundancy = find_redundancy(system)
    try:
        plan = plan_from(mechanism, system, origin, redundancy)
    except KinfmuError as problem:
        return Report(mechanism, redundancy, problem, None, None)
    return Report(mechanism, redundancy, None, plan, driver_range(plan))


def _row_json(row: DependentRow) -> dict[str, Any]:
    return {
        "name": row.row.owner,
        "row": row.row.name,
        "implied_by": list(row.implied_by_joints),
        "implied_by_rows": list(row.implied_by),
        "gap": row.gap,
    }


def _lines(report: Report) -> list[str]:
    mechanism = report.mechanism
    unit = mechanism.length_unit
    rows = sum(len(joint.labels) for joint in mechanism.joints)
    lines = [f"{mechanism.name}: {mechanism.title}" if mechanism.title else mechanism.name]
    lines.append(
        f"  bodies      {len(mechanism.moving_bodies)} moving: {listed(b.name for b in mechanism.moving_bodies)}"
    )
    lines.append(f"  joint rows  {rows} over {len(mechanism.coordinate_names)} coordinates")
    lines.append(f"  mobility    {report.mobility}, driven by {listed(driver.name for driver in mechanism.drivers)}")
    if report.gruebler != report.mobility:
        lines.append(f"              Gruebler's count gives {report.gruebler}: it does not see that rows are redundant")
    for row in report.redundant:
        reason = f"at every pose it follows from {listed(row.implied_by_joints)}; set aside and kept on watch"
        lines.append(f"  redundant   {row.row.owner} (row {row.row.name}): {reason}")
    if not report.redundancy.dependent:
        lines.append("  redundant   none")
    for row in report.inconsistent:
        gap = f"{abs(row.gap):.6g} {'rad' if row.row.kind == 'angle' else unit}"
        reason = f"{listed(row.implied_by_joints)} leave it open by {gap} at every pose"
        lines.append(f"  contradicts {row.row.owner} (row {row.row.name}): {reason}")
    plan = report.plan
    if plan is not None:
        lines.append(f"  start       {listed(_starts(report, plan))}")
        lines.append(f"  coordinates {listed(plan.coordinates)}")
        if plan.fixed:
            lines.append("  fixed       " + listed(f"{name} = {value:.6g}" for name, value in plan.fixed.items()))
        for k, block in enumerate(report.blocks, start=1):
            size = f"{len(block.rows)} x {len(block.unknowns)}"
            determinant = f", determinant {block.determinant}" if block.determinant else ""
            lines.append(f"  block {k}     {size}: {listed(block.unknowns)} from {listed(block.rows)}{determinant}")
        lines += _singular_lines(report)
    if report.problem is not None:
        lines.append(f"  problem     {report.problem}")
    return lines


def _singular_lines(report: Report) -> list[str]:
    if report.range is None or not report.mechanism.drivers:
        return []
    driver = report.mechanism.drivers[0]
    kind, unit = driver.quantity.kind, report.mechanism.length_unit
    lines = []
    changes = [point.value for point in report.singular if point.kind == "change point"]
    if changes:
        places = listed(written(value, unit, kind) for value in changes)
        every = "k pi: " if _all_multiples_of_pi(changes) else ""
        lines.append(f"  singular    {driver.name} = {every}{places}; branches cross, the motion goes on (bridged)")
    both = (report.range.low, report.range.high)
    if both != (None, None):
        low, high = ("no limit" if end is None else written(end, unit, kind) for end in both)
        lines.append(f"  range       {driver.name} from {low} to {high}; dead centre at each limit")
        beyond = _leaves_range(report, report.range)
        if beyond is not None:
            lines.append(beyond)
    elif kind == "angle":
        lines.append(f"  range       {driver.name} turns all the way round")
    if not report.singular:
        lines.append("  singular    nowhere on the way")
    return lines


def _starts(report: Report, plan: SolvePlan) -> list[str]:
    """Driver values from which runs are followed."""
    return [
        f"{driver.name} = {written(float(u), report.mechanism.length_unit, driver.quantity.kind)}"
        for driver, u in zip(report.mechanism.drivers, plan.anchor.u, strict=True)
    ]


def _leaves_range(report: Report, reach: DriverRange) -> str | None:
    """What to say when the file's run takes the driver past a limit."""
    driver, run = report.mechanism.drivers[0], report.mechanism.run
    constants = {key: getattr(driver.law, key) for key in driver.law.orders}
    ends = [float(driver.law.target(t, **constants)) for t in (run.start, run.stop)]
    low, high = (-math.inf if reach.low is None else reach.low), (math.inf if reach.high is None else reach.high)
    if low <= min(ends) and max(ends) <= high:
        return None
    asked = " to ".join(written(end, report.mechanism.length_unit, driver.quantity.kind) for end in ends)
    return f"  note        [run] takes {driver.name} from {asked}: beyond the range"


def _all_multiples_of_pi(values: list[float]) -> bool:
    """True for 0 and pi, modulo whole turns: k pi for every whole k."""
    return len(values) == 2 and [multiple_of_pi(value) for value in sorted(values)] == ["0", "pi"]


def _matrices(report: Report, plan: SolvePlan) -> tuple[Matrix, ...]:
    system = System(localized(report.mechanism)[0])
    assembled = assemble(system)
    moving = [name for name in system.coordinates if name not in plan.fixed]
    if assembled is None or not moving:
        return ()
    joint_rows = list(range(system.joint_row_count))
    driving = list(range(system.joint_row_count, len(system.rows)))
    solved = [*report.redundancy.kept, *driving]
    told = [moving_jacobian(system, assembled.q, joint_rows, moving, f"Phi_K,q at {_at(report, assembled.u[0])}")]
    told.append(moving_jacobian(system, assembled.q, solved, moving, f"Phi_q at {_at(report, assembled.u[0])}"))
    for point in report.singular:
        beside = point.value + SMALL_TURN
        if report.range and report.range.high is not None and beside > report.range.high:
            beside = point.value - SMALL_TURN
        for value, note in ((point.value, "singular point"), (beside, "a small turn beside it")):
            q = _pose(system, plan, value)
            if q is not None:
                told.append(moving_jacobian(system, q, solved, moving, f"Phi_q at {_at(report, value)}, {note}"))
    return tuple(told)


def _at(report: Report, value: float) -> str:
    driver = report.mechanism.drivers[0]
    return f"{driver.name} = {written(value, report.mechanism.length_unit, driver.quantity.kind)}"


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
