"""FitResult: what a fit found, as text, as a figure and in notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.display_unit import DisplayUnit
from kinfmu.readings import counted_from
from kinfmu.run import FloatArray
from kinfmu.sweep.continued import continued
from kinfmu.synthesis import display_units
from kinfmu.synthesis.equations import Equations, Evaluation, NotAssembledError
from kinfmu.synthesis.outcome import ConstraintResult, FitOutcome, Optimum, TargetErrors
from kinfmu.synthesis.problem import FitProblem
from kinfmu.synthesis.text import report

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HOLDS = 1e-6  # violation relative to the limit, or to 1, up to which a constraint holds
_NO_EFFECT = 1e-9  # of the largest effect: round-off
_SAME = 1e-6  # relative difference of sums up to which a mechanism file gives the motion that was fitted


class FitResult(FitOutcome, Displayed):
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
        idle: Unknowns that have no effect on the targets near the best design.
        note: What to know about `mechanism`; '' if there is nothing.

    """

    def __repr__(self) -> str:
        return f"<Fit of {self.mechanism.name}: sum of squares {self.squares:.6g}, rms {self.rms:.6g}>"

    def __str__(self) -> str:
        return "\n".join(report(self))

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


def result_of(equations: Equations, optima: Sequence[Optimum], tried: int, refused: Mapping[str, int]) -> FitResult:
    """Return the result of a search; its errors are those of the mechanism as a file of its own."""
    problem, best = equations.problem, optima[0]
    settable = problem.mechanism.settable
    settings = {name: settable.as_in_file(name, best.parameters[name]) for name in problem.parameters}
    followed = continued(problem.mechanism, settings)
    z = np.array([(best.parameters[name] - b.low) / (b.high - b.low) for name, b in problem.bounds.items()])
    fitted, jacobian = equations.at(z)
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
        parameters={**best.parameters, **{name: float(value) for name, value in settings.items()}},
        mechanism=followed.mechanism,
        errors=tuple(_errors(problem, found)),
        residuals=found.residuals[: found.target_count],
        squares=found.squares,
        constraints=tuple(_constraints(problem, found)),
        optima=tuple(optima),
        tried=tried,
        refused=dict(refused),
        idle=_idle(problem, jacobian),
        note=note,
    )


def _idle(problem: FitProblem, jacobian: FloatArray) -> tuple[str, ...]:
    """Return the unknowns whose columns of the Jacobian (r, n) are 0; none with measures, whose rows it leaves out."""
    sizes = np.linalg.norm(jacobian, axis=0)
    if problem.measuring is not None or not sizes.any():
        return ()
    return tuple(name for name, size in zip(problem.bounds, sizes, strict=True) if size <= _NO_EFFECT * sizes.max())


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
                sizes,
                float(np.sqrt((sizes**2).mean())),
                float(sizes.max()),
                display_units.of_columns(problem, target),
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
                    np.array([size]),
                    size,
                    size,
                    (display_units.of_measure(problem, aim.name, aim.unit),),
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
        holds = violation <= HOLDS * max(1.0, abs(one.gap))
        constraints.append(ConstraintResult(one.name, text, violation, holds, DisplayUnit(unit)))
    for aim, value in zip(problem.measuring.aims if problem.measuring else (), found.measured, strict=True):
        if aim.value is not None:
            continue
        display = display_units.of_measure(problem, aim.name, aim.unit)
        limits = [f"at least {aim.minimum / display.factor:.6g}"] if aim.minimum is not None else []
        limits += [f"at most {aim.maximum / display.factor:.6g}"] if aim.maximum is not None else []
        violation = max(0.0, aim.excess(float(value))[0])
        size = max(1.0, *(abs(limit) for limit in (aim.minimum, aim.maximum) if limit is not None))
        shown = display.suffix
        datum = counted_from(aim.reading.type)
        number = f"{float(value) / display.factor:.6g}{shown}{datum}"
        text = f"{aim.reading.type} = {number}, {' and '.join(limits)}{shown}"
        constraints.append(ConstraintResult(aim.name, text, violation, violation <= HOLDS * size, display))
    return constraints
