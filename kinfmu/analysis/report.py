"""check(): what a good colleague would say about a mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kinfmu.analysis.assemblies import Assemblies, find_assemblies
from kinfmu.analysis.design_notes import motion_notes, part_notes
from kinfmu.analysis.drivers import DriverAdvice, better_told, driver_advice
from kinfmu.analysis.file_notes import file_notes, run_notes, start_notes
from kinfmu.analysis.findings import as_json
from kinfmu.analysis.matrices import Matrix
from kinfmu.analysis.named import NamedLoop, find_named
from kinfmu.analysis.pose_matrices import pose_matrices
from kinfmu.analysis.singular import DriverRange, SingularPoint, driver_range
from kinfmu.analysis.text import lines
from kinfmu.analysis.way import follow
from kinfmu.equations.redundancy import DependentRow, Redundancy, find_redundancy
from kinfmu.equations.system import System
from kinfmu.errors import AssemblyError, KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.plan import SolvePlan, determinant_formula, localized, plan_from


@dataclass(frozen=True)
class BlockReport:
    """A block of the plan: what it solves for, from which rows, and its determinant where that is a short formula."""

    unknowns: tuple[str, ...]
    rows: tuple[str, ...]
    determinant: str | None


@dataclass(frozen=True)
class Report:
    """Findings of a check. `problem` says why the mechanism cannot be solved, None if it can.

    ranges: one a driver, in file order; loops: the four-bars and slider-cranks among the joints; advice: on drivers,
    None where drivers and degrees of freedom match; notes: what else a colleague would say, one line each.
    """

    mechanism: Mechanism
    redundancy: Redundancy
    problem: KinfmuError | None
    plan: SolvePlan | None
    ranges: tuple[DriverRange, ...] = ()
    loops: tuple[NamedLoop, ...] = ()
    advice: DriverAdvice | None = None
    notes: tuple[str, ...] = ()

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
    def starts(self) -> tuple[float, ...]:
        """Values of the drivers from which the run starts, by their laws [rad or length]."""
        return tuple(float(driver.law.at(self.mechanism.run.start)) for driver in self.mechanism.drivers)

    @property
    def range(self) -> DriverRange | None:
        """The range of the only driver; None if there are several, or no plan."""
        return self.ranges[0] if len(self.mechanism.drivers) == 1 and self.ranges else None

    @property
    def singular(self) -> tuple[SingularPoint, ...]:
        """Singular points on the way of each driver, the others at their start values."""
        return tuple(point for reach in self.ranges for point in reach.points)

    @property
    def blocks(self) -> tuple[BlockReport, ...]:
        """Blocks that need Newton, in the order of solving."""
        if self.plan is None:
            return ()
        return tuple(
            BlockReport(block.unknowns, block.row_names, determinant_formula(block, self.plan.parameter_values))
            for block in self.plan.blocks
            if block.unknowns
        )

    def as_json(self) -> dict[str, Any]:
        """The findings as plain data; its keys are those of `kinfmu.analysis.findings.as_json`."""
        return as_json(self)

    def __str__(self) -> str:
        return "\n".join(lines(self))

    def assemblies(self) -> Assemblies:
        """Every way of putting the mechanism together at its start driver values.

        Raises the report's `problem` if it is not one of the start poses, an AssemblyError if nothing closes.
        """
        if self.problem is not None and not isinstance(self.problem, AssemblyError):
            raise self.problem
        return find_assemblies(self.mechanism, self.plan)

    def matrices(self) -> tuple[Matrix, ...]:
        """The report's matrices: Phi_K,q at the start pose, Phi_q at each singular point and a small turn beside it."""
        if self.plan is None:
            raise self.problem or KinfmuError("there is no plan, so there are no matrices")
        return pose_matrices(self.plan, self.redundancy, self.range)


def check(mechanism: Mechanism) -> Report:
    """Mobility, redundant and inconsistent rows, plan, drivers, loops, singular points and ranges of a mechanism.

    Faults of the mechanism do not raise; they stand in the report's `problem`.
    """
    require_mechanism(mechanism, "check")
    notes = [*file_notes(mechanism), *part_notes(mechanism)]
    local, origin = localized(mechanism)
    system = System(local)
    redundancy = find_redundancy(system)
    try:
        plan = plan_from(mechanism, system, origin, redundancy)
    except KinfmuError as problem:
        advice = driver_advice(system, redundancy)
        loops = find_named(mechanism, redundancy, ())
        problem = better_told(problem, redundancy, advice)
        return Report(mechanism, redundancy, problem, None, (), loops, advice, tuple(notes))
    notes += start_notes(system, redundancy.assembly.start)
    ways = []
    for number, driver in enumerate(mechanism.drivers):
        try:
            ways.append(follow(plan, number))
        except KinfmuError as reason:
            notes.append(f"{driver.name} cannot be followed alone: {reason}")
    ranges = tuple(driver_range(way) for way in ways)
    notes += run_notes(plan, ranges)
    loops = find_named(mechanism, redundancy, ways)
    notes += motion_notes(mechanism, ways, loops)
    return Report(mechanism, redundancy, None, plan, ranges, loops, None, tuple(notes))
