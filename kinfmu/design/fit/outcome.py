"""What a fit found: errors of the targets, how far constraints are met, the other optima; the units that show them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.equations import Evaluation
from kinfmu.design.fit.measuring import Aim
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.sampled import Sampled
from kinfmu.design.fit.targets import flat
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures import counted_from
from kinfmu.mechanism.number import DisplayUnit, display_unit, written_unit
from kinfmu.units import Quantity, quantity_in, unit_of

_LENGTH, _ANGLE = Quantity("length"), Quantity("angle")
HOLDS = 1e-6  # violation relative to the limit, or to 1, up to which a constraint holds


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
        reached: (m, d) what the mechanism reaches, in `units`.
        errors: (m, d) reached minus wanted; of angles without whole turns.
        sizes: (m,) sizes of the points' errors, in the unit of the first column; angles of poses count times their
            length.
        display: The units of the columns in reports.

    """

    name: str
    type: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    argument: str
    at: FloatArray
    reached: FloatArray
    errors: FloatArray
    sizes: FloatArray
    display: tuple[DisplayUnit, ...]

    @property
    def wanted(self) -> FloatArray:
        """Targets (m, d), in `units`."""
        return self.reached - self.errors

    @property
    def rms(self) -> float:
        """Root of the mean of the squares of the sizes."""
        return float(np.sqrt((self.sizes**2).mean()))

    @property
    def largest(self) -> float:
        """Largest error of a point."""
        return float(self.sizes.max())


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


def unit_of_unknown(problem: FitProblem, name: str) -> DisplayUnit:
    """Return the unit of an unknown: of its bounds, else of the mechanism file."""
    if name in problem.unknowns:
        return problem.mechanism.settable.display_unit(name, flat(problem.unknowns[name]))
    owner, _, key = name.rpartition(".")
    target: Any = next(target for target in problem.targets if target.name == owner)
    length = problem.mechanism.length_unit
    return display_unit(problem.quantity(name), length, written_unit(flat(getattr(target, key)), length))


def units_of_columns(problem: FitProblem, sampled: Sampled) -> tuple[DisplayUnit, ...]:
    """Return the units of the columns of a path, function or poses: of its points, all lengths in the first one."""
    target: Any = next(one for one in problem.targets if one.name == sampled.name)
    rows = [list(row) for row in (target.poses if sampled.type == "poses" else target.points)]
    length, units = problem.mechanism.length_unit, []
    for is_angle in sampled.angles:
        places = [k for k, angle in enumerate(sampled.angles) if angle is is_angle]
        places = [1] if sampled.type == "function" else places
        written = written_unit([row[k] for row in rows for k in places], length)
        if not written and sampled.type == "function":
            written = written_unit(flat(target.offset), length)
        units.append(display_unit(_ANGLE if is_angle else _LENGTH, length, written))
    return tuple(units)


def unit_of_measure(problem: FitProblem, name: str, unit: str) -> DisplayUnit:
    """Return the unit of a measure: of its value or limits; `unit`: that used inside."""
    if unit == "1":
        return DisplayUnit()
    owner: Any = next(owner for owner in (*problem.targets, *problem.constraints) if owner.name == name)
    length = problem.mechanism.length_unit
    written = written_unit((getattr(owner, key, None) for key in ("value", "minimum", "maximum")), length)
    return display_unit(quantity_in(unit, length), length, written)


def argument_unit(problem: FitProblem) -> str:
    """Return the unit of the argument of the motion."""
    return unit_of(problem.argument.quantity, problem.mechanism.length_unit)


def constraint_results(problem: FitProblem, evaluation: Evaluation) -> list[ConstraintResult]:
    """Return how far the constraints of a problem are met by a design, Grashof's conditions first."""
    unit, constraints = problem.mechanism.length_unit, []
    for condition, met in zip(problem.lengths, evaluation.excess, strict=True):
        gap = float(met[: condition.gaps].min()) + condition.gap
        text = f"p + q - s - l = {gap:.6g} {unit}, at least {condition.gap:.6g} {unit}"
        if condition.shortest is not None:
            others = float(met[condition.gaps :].min())
            shortest = condition.links[condition.shortest].text
            text += f"; the other links exceed {shortest} by {others:.6g} {unit} or more"
        violation = max(0.0, -float(met.min()))
        holds = violation <= HOLDS * max(1.0, abs(condition.gap))
        constraints.append(ConstraintResult(condition.name, text, violation, holds, DisplayUnit(unit)))
    limited: dict[str, list[tuple[Aim, float]]] = {}
    aims = problem.measuring.aims if problem.measuring else ()
    for aim, value in zip(aims, evaluation.measured.tolist(), strict=True):
        if aim.value is None:
            limited.setdefault(aim.owner, []).append((aim, value))
    for name, parts in limited.items():
        aim, value = max(parts, key=lambda part: part[0].excess(part[1])[0])
        display = unit_of_measure(problem, name, aim.unit)
        limits = [f"at least {aim.minimum / display.factor:.6g}"] if aim.minimum is not None else []
        limits += [f"at most {aim.maximum / display.factor:.6g}"] if aim.maximum is not None else []
        violation = max(0.0, aim.excess(value)[0])
        size = max(1.0, *(abs(limit) for limit in (aim.minimum, aim.maximum) if limit is not None))
        number = f"{value / display.factor:.6g}{display.suffix}{counted_from(aim.reading.type)}"
        text = f"{aim.reading.type} = {number}, {' and '.join(limits)}{display.suffix}"
        constraints.append(ConstraintResult(name, text, violation, violation <= HOLDS * size, display))
    return constraints
