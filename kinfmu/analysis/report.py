"""The report of a mechanism, and `check`, which makes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kinfmu.analysis.assemblies import Assemblies, find_assemblies
from kinfmu.analysis.design_notes import motion_notes, part_notes
from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.drivers import DriverAdvice, clearer_problem, driver_advice
from kinfmu.analysis.file_notes import file_notes, run_notes, start_notes
from kinfmu.analysis.findings import as_json
from kinfmu.analysis.matrices import Matrix
from kinfmu.analysis.named_loops import NamedLoop, find_named_loops
from kinfmu.analysis.pose_matrices import pose_matrices
from kinfmu.analysis.singular import DriverRange, SingularPoint, driver_range
from kinfmu.analysis.text import lines
from kinfmu.equations.redundancy import DependentRow, Redundancy, find_redundancy
from kinfmu.equations.system import System
from kinfmu.errors import AssemblyError, KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.plan import SolvePlan, determinant_formula, localized, plan_from


@dataclass(frozen=True)
class BlockReport:
    """A block of the plan: its unknowns, its rows, and its determinant if that is a short formula."""

    unknowns: tuple[str, ...]
    rows: tuple[str, ...]
    determinant: str | None


@dataclass(frozen=True)
class Report:
    """Findings of a check. `problem` is the error that prevents solving, None if there is none.

    ranges: one per driver, in file order; loops: the four-bars and slider-cranks among the joints; advice: on drivers,
    None where drivers and degrees of freedom match; notes: further findings, one line each.
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
        """Coordinates minus independent joint rows."""
        return self.redundancy.mobility

    @property
    def gruebler(self) -> int:
        """Mobility by Gruebler's count, which ignores redundancy: coordinates minus joint rows."""
        return len(self.mechanism.coordinate_names) - sum(len(joint.labels) for joint in self.mechanism.joints)

    @property
    def redundant(self) -> tuple[DependentRow, ...]:
        return self.redundancy.redundant

    @property
    def inconsistent(self) -> tuple[DependentRow, ...]:
        return self.redundancy.inconsistent

    @property
    def starts(self) -> tuple[float, ...]:
        """Driver values at the start of the run, from their laws [rad or length]."""
        return tuple(float(driver.law.at(self.mechanism.run.start)) for driver in self.mechanism.drivers)

    @property
    def range(self) -> DriverRange | None:
        """The range of the only driver; None if there are several, or no plan."""
        return self.ranges[0] if len(self.mechanism.drivers) == 1 and self.ranges else None

    @property
    def singular(self) -> tuple[SingularPoint, ...]:
        """Singular points on the path of each driver, the others at their start values."""
        return tuple(point for reach in self.ranges for point in reach.points)

    @property
    def blocks(self) -> tuple[BlockReport, ...]:
        """Blocks that need Newton, in solving order."""
        if self.plan is None:
            return ()
        return tuple(
            BlockReport(block.unknowns, block.row_names, determinant_formula(block, self.plan.parameter_values))
            for block in self.plan.blocks
            if block.unknowns
        )

    def as_json(self) -> dict[str, Any]:
        """Return the findings as plain data, with the keys of `kinfmu.analysis.findings.as_json`."""
        return as_json(self)

    def __str__(self) -> str:
        return "\n".join(lines(self))

    def assemblies(self) -> Assemblies:
        """Return all assemblies of the mechanism at its start driver values.

        Raises:
            KinfmuError: The report's `problem`, if it is not one of the start poses.
            AssemblyError: If no assembly is found.

        """
        if self.problem is not None and not isinstance(self.problem, AssemblyError):
            raise self.problem
        return find_assemblies(self.mechanism, self.plan)

    def matrices(self) -> tuple[Matrix, ...]:
        """Return Phi_K,q and Phi_q at the start pose, Phi_q at each singular point and after a small turn.

        Raises:
            KinfmuError: If the mechanism has no plan.

        """
        if self.plan is None:
            raise self.problem or KinfmuError("there is no plan, so there are no matrices")
        return pose_matrices(self.plan, self.redundancy, self.range)


def check(mechanism: Mechanism) -> Report:
    """Check a mechanism: mobility, redundancy, plan, drivers, loops, singular points, ranges.

    Args:
        mechanism: The mechanism to check.

    Returns:
        The report. An error of the mechanism is not raised; it is the report's `problem`.

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
        loops = find_named_loops(mechanism, redundancy, ())
        problem = clearer_problem(problem, redundancy, advice)
        return Report(mechanism, redundancy, problem, None, (), loops, advice, tuple(notes))
    notes += start_notes(system, redundancy.assembly.start)
    paths = []
    for number, driver in enumerate(mechanism.drivers):
        try:
            paths.append(follow(plan, number))
        except KinfmuError as reason:
            notes.append(f"{driver.name} cannot be followed alone: {reason}")
    ranges = tuple(driver_range(path) for path in paths)
    notes += run_notes(plan, ranges)
    loops = find_named_loops(mechanism, redundancy, paths)
    notes += motion_notes(mechanism, paths, loops)
    return Report(mechanism, redundancy, None, plan, ranges, loops, None, tuple(notes))
