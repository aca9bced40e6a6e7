"""What a fit found: the mechanism, its errors, how far constraints are met, and the other optima."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.problem import FitProblem
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.display_unit import DisplayUnit
from kinfmu.units import unit_of


@dataclass(frozen=True)
class Optimum:
    """A local optimum.

    Attributes:
        parameters: Values of the unknowns by name.
        squares: Weighted sum of squares of the targets.
        total: The same with penalties.
        searches: Number of whole searches that ended there.
        holds: Whether all constraints are met.

    """

    parameters: Mapping[str, float]
    squares: float
    total: float
    searches: int
    holds: bool


@dataclass(frozen=True, eq=False)
class TargetErrors:
    """The errors of a target.

    Attributes:
        name: Name of the target.
        type: Its type, such as 'path'.
        names: Names of the d columns.
        units: Their units.
        argument: Name of the driver, or 'time'.
        at: (m,) its values at the points; empty for a measure.
        wanted: (m, d) targets, in `units`.
        reached: (m, d) what the mechanism reaches, in `units`.
        errors: (m, d) reached minus wanted; of angles without whole turns.
        sizes: (m,) sizes of the points' errors, in the unit of the first column; angles of poses count times their
            length.
        rms: Root of the mean of their squares.
        largest: Largest error of a point.
        display: The units of the columns in reports.

    """

    name: str
    type: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    argument: str
    at: FloatArray
    wanted: FloatArray
    reached: FloatArray
    errors: FloatArray
    sizes: FloatArray
    rms: float
    largest: float
    display: tuple[DisplayUnit, ...]


@dataclass(frozen=True)
class ConstraintResult:
    """How far a constraint is met.

    Attributes:
        name: Name of the constraint.
        text: The value and its limit.
        violation: By how much the limit is exceeded; 0 if it is not.
        holds: Whether it is met, within a millionth of the limit.
        display: The unit of the violation in reports.

    """

    name: str
    text: str
    violation: float
    holds: bool
    display: DisplayUnit


@dataclass(frozen=True, eq=False, kw_only=True)
class FitOutcome:
    """What a fit found; attributes as in `FitResult`."""

    problem: FitProblem
    parameters: Mapping[str, float]
    mechanism: Mechanism
    errors: tuple[TargetErrors, ...]
    residuals: FloatArray
    squares: float
    constraints: tuple[ConstraintResult, ...]
    optima: tuple[Optimum, ...]
    tried: int
    refused: Mapping[str, int]
    idle: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()
    note: str = ""

    @property
    def rms(self) -> float:
        """Root of the mean of the squares of the residuals."""
        return math.sqrt(self.squares / max(1, len(self.residuals)))

    @property
    def holds(self) -> bool:
        """Whether all constraints are met."""
        return all(one.holds for one in self.constraints)


def argument_unit(problem: FitProblem) -> str:
    """Return the unit of the argument of the motion."""
    return unit_of(problem.argument.quantity, problem.mechanism.length_unit)
