"""FitResult: what a fit found, as text, as a figure and in notebooks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.equations import Equations, Evaluation, NotAssembledError
from kinfmu.design.fit.outcome import (
    FitOutcome,
    Optimum,
    TargetErrors,
    constraint_results,
    unit_of_measure,
    units_of_columns,
)
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.text import report
from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.run.continued import continued

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_NO_EFFECT = 1e-9  # of the largest effect: round-off
_FREE = 1e-4  # of the largest singular value; differences of measures have an error of 1e-6
_PART = 1e-3  # of a free direction; an unknown with less is determined
_AT_BOUND = 1e-6  # of the range
_MET = 1e-9  # of the root of the sum of squares of a typical design; targets with less are met
_EQUAL, _SEVERAL = 1e-7, 2  # relative difference of equal sums; more optima than a symmetric mechanism has
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
        undetermined: Unknowns that can change together so that the errors stay: others fit as well.
        note: What to know about `mechanism`; '' if there is nothing.

    """

    def __repr__(self) -> str:
        return f"<Fit of {self.mechanism.name}: sum of squares {self.squares:.6g}, rms residual {self.rms:.6g}>"

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
        from kinfmu.design.fit.picture import draw

        draw(self, path, ax)


class _Design(NamedTuple):
    """An optimum as a mechanism file of its own.

    fitted, jacobian: Of the search; own: of the mechanism file, None if it does not assemble; note: on the file.
    """

    optimum: Optimum
    settings: Mapping[str, float | str]
    mechanism: Mechanism
    z: FloatArray
    fitted: Evaluation
    jacobian: FloatArray
    own: Evaluation | None
    note: str

    @property
    def is_fitted(self) -> bool:
        """Whether the file gives the motion that was fitted; at a change point it may take the other branch."""
        return self.own is not None and abs(self.own.total - self.fitted.total) <= _SAME * self.fitted.total + 1e-12

    @property
    def total(self) -> float:
        return math.inf if self.own is None else self.own.total


def result_of(equations: Equations, optima: Sequence[Optimum], tried: int, refused: Mapping[str, int]) -> FitResult:
    """Return the result of a search; its errors are those of the mechanism as a file of its own.

    The best optimum whose file gives the fitted motion is chosen; if there is none, the one with the smallest sum of
    its file.
    """
    problem, designs = equations.problem, []
    for optimum in optima:
        designs.append(_as_file(equations, optimum))
        if designs[-1].is_fitted:
            break
    best = next((one for one in designs if one.is_fitted), min(designs, key=lambda one: one.total))
    notes = []
    for one in designs if best.is_fitted else ():
        if one is not best:
            at = listed(f"{name} = {value:.6g}" for name, value in one.optimum.parameters.items())
            notes.append(f"the optimum at {at} is not chosen: {one.note}")
    found = best.own or best.fitted
    own_sums = {id(one.optimum): one.own for one in designs if one.own is not None}
    others = [one for one in optima if one is not best.optimum]
    shown = [
        replace(one, squares=own.squares, total=own.total) if (own := own_sums.get(id(one))) else one
        for one in (best.optimum, *others)
    ]
    return FitResult(
        problem=problem,
        parameters={**best.optimum.parameters, **{name: float(value) for name, value in best.settings.items()}},
        mechanism=best.mechanism,
        errors=tuple(_errors(problem, found)),
        residuals=found.residuals[: found.target_count],
        squares=found.squares,
        constraints=tuple(constraint_results(problem, found)),
        optima=(shown[0], *sorted(shown[1:], key=lambda one: (not one.holds, one.total))),
        tried=tried,
        refused=dict(refused),
        idle=_idle(problem, best.jacobian),
        undetermined=_undetermined(equations, best.z, best.fitted, best.jacobian, (best.optimum, *others)),
        note="; ".join(filter(None, [*notes, best.note])),
    )


def _as_file(equations: Equations, optimum: Optimum) -> _Design:
    """Return an optimum as a mechanism file, started in the pose of the fit."""
    problem = equations.problem
    settable = problem.mechanism.settable
    settings = {name: settable.as_in_file(name, optimum.parameters[name]) for name in problem.parameters}
    followed = continued(problem.mechanism, settings)
    z = np.array([(optimum.parameters[name] - b.low) / (b.high - b.low) for name, b in problem.bounds.items()])
    fitted, jacobian = equations.at(z)
    try:
        again = Equations(problem.of(followed.mechanism), "python")
        again.scale = equations.scale
        own, _ = again.at(z)
    except (KinfmuError, NotAssembledError) as reason:
        note = f"the mechanism does not assemble from its file: {reason}"
        return _Design(optimum, settings, followed.mechanism, z, fitted, jacobian, None, note)
    design = _Design(optimum, settings, followed.mechanism, z, fitted, jacobian, own, followed.message)
    if design.is_fitted:
        return design
    return design._replace(
        note=f"the mechanism file assembles in another way, as at a change point: its sum of squares is "
        f"{own.squares:.6g}, that of the search {fitted.squares:.6g}"
    )


def _idle(problem: FitProblem, jacobian: FloatArray) -> tuple[str, ...]:
    """Return the unknowns whose columns of the Jacobian (r, n) are 0; none with measures, whose rows it leaves out."""
    sizes = np.linalg.norm(jacobian, axis=0)
    if problem.measuring is not None or not sizes.any():
        return ()
    return tuple(name for name, size in zip(problem.bounds, sizes, strict=True) if size <= _NO_EFFECT * sizes.max())


def _undetermined(
    equations: Equations, z: FloatArray, found: Evaluation, jacobian: FloatArray, optima: Sequence[Optimum]
) -> tuple[str, ...]:
    """Return the unknowns in the null space of the Jacobian of targets and active constraints; bounds hold unknowns.

    Where the targets are not met, the Jacobian alone does not tell an isolated optimum from others: there must be
    several optima of the same sum.
    """
    twins = sum(abs(one.total - optima[0].total) <= _EQUAL * optima[0].total for one in optima[1:])
    if math.sqrt(found.squares) > _MET * equations.scale and twins < _SEVERAL:
        return ()
    full = equations.with_measures(z, found, jacobian)
    rows = full[(np.arange(len(full)) < found.target_count) | (found.residuals > 0.0)]
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    is_open = (z > _AT_BOUND) & (z < 1.0 - _AT_BOUND) & (np.abs(rows).max(axis=0, initial=0.0) > _NO_EFFECT)
    if not is_open.any():
        return ()
    _, values, directions = np.linalg.svd(rows[:, is_open])
    rank = int((values > _FREE * values.max(initial=0.0)).sum())
    moves = np.abs(directions[rank:]).max(axis=0, initial=0.0) > _PART
    names = [name for name, counts in zip(equations.names, is_open, strict=True) if counts]
    return tuple(name for name, counts in zip(names, moves, strict=True) if counts)


def _errors(problem: FitProblem, found: Evaluation) -> list[TargetErrors]:
    unit, argument = problem.mechanism.length_unit, problem.argument.name
    errors = [
        TargetErrors(
            name=row.target.name,
            type=row.target.type,
            names=row.target.shown,
            units=tuple("rad" if is_angle else unit for is_angle in row.target.angles),
            argument=argument,
            at=row.arguments,
            reached=row.reached,
            errors=row.errors,
            sizes=np.sqrt(((row.errors * row.target.scale) ** 2).sum(axis=1)),
            display=units_of_columns(problem, row.target),
        )
        for row in found.rows
    ]
    aims: Any = problem.measuring.aims if problem.measuring else ()
    for aim, value in zip(aims, found.measured, strict=True):
        if aim.value is not None:
            error = float(value) - aim.value
            errors.append(
                TargetErrors(
                    name=aim.owner,
                    type="measure",
                    names=(aim.owner,),
                    units=(aim.unit,),
                    argument="",
                    at=np.empty(0),
                    reached=np.array([[float(value)]]),
                    errors=np.array([[error]]),
                    sizes=np.array([abs(error)]),
                    display=(unit_of_measure(problem, aim.owner, aim.unit),),
                )
            )
    return errors
