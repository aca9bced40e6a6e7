"""FitResult: the mechanism that a fit found, its errors, and the other optima."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.run import FloatArray
from kinfmu.sweep.continued import continued
from kinfmu.synthesis.equations import Equations, Evaluation, NotAssembledError
from kinfmu.synthesis.problem import FitProblem
from kinfmu.units import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HOLDS = 1e-6  # violation relative to the limit, or to 1, up to which a constraint holds
MOST_OPTIMA = 10  # in a text
_SAME = 1e-6  # relative difference of sums up to which a mechanism file gives the motion that was fitted


@dataclass(frozen=True)
class Optimum:
    """A local optimum.

    Attributes:
        parameters: Values of the unknowns by name.
        total: Weighted sum of squares, with penalties.
        searches: Number of whole searches that ended there.

    """

    parameters: Mapping[str, float]
    total: float
    searches: int


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
        wanted: (m, d).
        reached: (m, d).
        errors: (m, d) reached minus wanted; of angles without whole turns.
        rms: Root of the mean square of the points' errors; angles of poses count times their length.
        largest: Largest error of a point.

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
    rms: float
    largest: float


@dataclass(frozen=True)
class ConstraintResult:
    """How far a constraint is met.

    Attributes:
        name: Name of the constraint.
        text: The value and its limit.
        violation: By how much the limit is exceeded; 0 if it is not.
        holds: Whether it is met, within a millionth of the limit.

    """

    name: str
    text: str
    violation: float
    holds: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class FitResult:
    """The best design that a fit found.

    Attributes:
        problem: The problem.
        parameters: Values of the unknowns by name.
        mechanism: The mechanism with these parameters, started in the pose of the fit.
        errors: Errors of the targets. They are those of `mechanism`.
        residuals: (r,) weighted errors, without penalties.
        squares: Sum of their squares.
        constraints: How far the constraints are met.
        optima: The local optima found, best first.
        tried: Number of designs that were solved.
        refused: How often designs could not be assembled or did not reach a sample, by reason.
        note: What to know about `mechanism`; '' if there is nothing.

    """

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
    note: str = ""

    @property
    def rms(self) -> float:
        """Root of the mean of the squares of the residuals."""
        return math.sqrt(self.squares / max(1, len(self.residuals)))

    @property
    def holds(self) -> bool:
        """Whether all constraints are met."""
        return all(one.holds for one in self.constraints)

    def figure(self, path: str | Path | None = None, *, ax: Axes | None = None) -> None:
        """Draw what was wanted, what is reached, and the mechanism at one pose.

        Args:
            path: A .svg or .png file.
            ax: Axes of matplotlib to draw into, in place of a file: the first target alone.

        Raises:
            FigureError: The suffix is unknown, or the file cannot be written.
            MissingPackageError: matplotlib is not installed.

        """
        from kinfmu.synthesis.picture import draw

        draw(self, path, ax)

    def __str__(self) -> str:
        from kinfmu.synthesis.text import report

        return report(self)

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td style='text-align:right'>{value:.9g}</td></tr>"
            for name, value in self.parameters.items()
        )
        title = f"{html.escape(self.mechanism.name)}: sum of squares {self.squares:.6g}, rms {self.rms:.6g}"
        return f"<table><caption>{title}</caption><tr><th>unknown</th><th>value</th></tr>{rows}</table>"


def result_of(equations: Equations, optima: Sequence[Optimum], tried: int, refused: Mapping[str, int]) -> FitResult:
    """Return the result of a search; its errors are those of the mechanism as a file of its own."""
    problem, best = equations.problem, optima[0]
    settings = {name: best.parameters[name] for name in problem.parameters}
    followed = continued(problem.mechanism, settings)
    z = np.array([(best.parameters[name] - b.low) / (b.high - b.low) for name, b in problem.bounds.items()])
    fitted, _ = equations.at(z)
    found, note = fitted, followed.message
    try:
        again = Equations(problem.of(followed.mechanism), "python")
        found, _ = again.at(z)
        if abs(found.total - fitted.total) > _SAME * fitted.total + 1e-12:
            note = f"the mechanism file assembles in another way: its sum of squares is {found.squares:.6g}"
    except (KinfmuError, NotAssembledError) as reason:
        note = f"the mechanism does not assemble from its file: {reason}"
    return FitResult(
        problem=problem,
        parameters=dict(best.parameters),
        mechanism=followed.mechanism,
        errors=tuple(_errors(problem, found)),
        residuals=found.residuals[: found.target_count],
        squares=found.squares,
        constraints=tuple(_constraints(problem, found)),
        optima=tuple(optima),
        tried=tried,
        refused=dict(refused),
        note=note,
    )


def _errors(problem: FitProblem, found: Evaluation) -> list[TargetErrors]:
    unit, argument = problem.mechanism.length_unit, problem.argument.name
    result = []
    for row in found.rows:
        target = row.target
        sizes = np.sqrt(((row.errors * target.scale) ** 2).sum(axis=1))
        result.append(
            TargetErrors(
                target.name,
                target.type,
                target.shown,
                tuple("rad" if is_angle else unit for is_angle in target.angles),
                argument,
                row.arguments,
                row.reached - row.errors,
                row.reached,
                row.errors,
                float(np.sqrt((sizes**2).mean())),
                float(sizes.max()),
            )
        )
    aims: Any = problem.measuring.aims if problem.measuring else ()
    for aim, value in zip(aims, found.measured, strict=True):
        if aim.value is not None:
            error = np.array([[float(value) - aim.value]])
            size = abs(float(error[0, 0]))
            reached = np.array([[float(value)]])
            result.append(
                TargetErrors(
                    aim.name,
                    "measure",
                    (aim.name,),
                    (aim.unit,),
                    "",
                    np.empty(0),
                    reached - error,
                    reached,
                    error,
                    size,
                    size,
                )
            )
    return result


def _constraints(problem: FitProblem, found: Evaluation) -> list[ConstraintResult]:
    unit, constraints = problem.mechanism.length_unit, []
    for one, met in zip(problem.lengths, found.excess, strict=True):
        gap = float(met[0]) + one.gap
        text = f"p + q - s - l = {gap:.6g} {unit}, at least {one.gap:.6g} {unit}"
        if one.shortest is not None:
            text += (
                f"; the other links exceed {one.links[one.shortest].text} by {float(met[1:].min()):.6g} {unit} or more"
            )
        violation = max(0.0, -float(met.min()))
        constraints.append(ConstraintResult(one.name, text, violation, violation <= HOLDS * max(1.0, abs(one.gap))))
    for aim, value in zip(problem.measuring.aims if problem.measuring else (), found.measured, strict=True):
        if aim.value is not None:
            continue
        limits = [f"at least {aim.minimum:.6g}"] if aim.minimum is not None else []
        limits += [f"at most {aim.maximum:.6g}"] if aim.maximum is not None else []
        violation = max(0.0, aim.excess(float(value))[0])
        size = max(1.0, *(abs(limit) for limit in (aim.minimum, aim.maximum) if limit is not None))
        shown = "" if aim.unit == "1" else f" {aim.unit}"
        text = f"{aim.reading.type} = {float(value):.6g}{shown}, {' and '.join(limits)}{shown}"
        constraints.append(ConstraintResult(aim.name, text, violation, violation <= HOLDS * size))
    return constraints


def argument_unit(problem: FitProblem) -> str:
    """Return the unit of the argument of the motion."""
    return unit_of(problem.argument.quantity, problem.mechanism.length_unit)
