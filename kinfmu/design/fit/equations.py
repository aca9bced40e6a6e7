"""Residuals of a fit and their exact Jacobian, from the sensitivities of a model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import NotReachedError, crossings, modulo, nearest
from kinfmu.design.fit.measuring import Aim
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.sampled import Sampled
from kinfmu.design.fit.targets import Bounds
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.plan import compile_plan
from kinfmu.run.model import Model
from kinfmu.solver.python.pose import Status
from kinfmu.units import unit_of

VANISHED = 1e-8  # violation, as a part of the limit's size, that counts as none
SLOW = 0.25  # of a violation: where more than this is left of it after a search, its penalty grows
STIFFER, STIFFEST = 10.0, 1e5  # by which a penalty's root grows, and the factor at which a violation does not vanish


class NotAssembledError(Exception):
    """A design cannot be assembled, or does not reach a sample; the text is the reason."""


class Rows(NamedTuple):
    """Errors (k, d) of a target in its units, and the rows of the Jacobian (k d, n) of the weighted residuals."""

    target: Sampled
    arguments: FloatArray
    reached: FloatArray
    errors: FloatArray
    jacobian: FloatArray


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A design and how far it is from the targets.

    Attributes:
        rows: Of the sampled targets.
        measured: Values of measures, in the order of the problem.
        excess: By how much Grashof's conditions are met, one array for each constraint.
        residuals: Of targets and penalties, weighted (r,).
        target_count: Number of residuals that are no penalties.
        violations: By how much limits are exceeded, as parts of their sizes, in the order of the penalties; negative
            within them.

    """

    rows: tuple[Rows, ...]
    measured: FloatArray
    excess: tuple[FloatArray, ...]
    residuals: FloatArray
    target_count: int
    violations: FloatArray

    @property
    def squares(self) -> float:
        """The weighted sum of squares of the targets, without penalties."""
        return float(self.residuals[: self.target_count] @ self.residuals[: self.target_count])

    @property
    def total(self) -> float:
        """The sum that is minimised, with penalties."""
        return float(self.residuals @ self.residuals)


class Equations:
    """The residuals of a problem as functions of the unknowns z, parts of the ranges between their bounds.

    Untimed points are compared with the nearest point of the path, at the argument u*:

        r = P(u*) - T,   r.P'(u*) = 0,   dr/dp = P_p - (P_p.t) t   with t = P' / |P'|

    This is the Jacobian of Gauss and Newton for variable projection (Kaufman 1975): the gradient of the sum of squares
    is exact, and so is the Jacobian where r = 0. For a function y(x) of another output, x(u) = x_k gives

        r = y(u) - y_k,   dr/dp = y_p - (y'/x') x_p

    engine: 'python' or 'native'.
    """

    def __init__(self, problem: FitProblem, engine: str = "python") -> None:
        self.problem, self.engine = problem, engine
        self.measuring = problem.measuring.on(engine) if problem.measuring else None
        outputs = dict.fromkeys(name for one in problem.sampled for name in (*one.outputs, one.over) if name)
        self.outputs = tuple(outputs)
        self.names = tuple(problem.bounds)
        self.scale = 1.0  # to which penalties are relative: root of the sum of squares of a typical design's targets
        self.shifts = np.zeros_like(self._relative_roots)  # of the limits, while a search makes violations vanish
        self.stiffness = np.ones_like(self.shifts)  # factors of the penalties, of violations that vanish slowly
        self._ranges = np.array([bounds.high - bounds.low for bounds in problem.bounds.values()])

    @cached_property
    def _model(self) -> Model:
        """The model of the sampled targets; with the native engine it is compiled when it is first used."""
        parameters = [name for name in self.problem.parameters if name in self.problem.mechanism.parameters]
        return Model(compile_plan(self.problem.traced, self.outputs, parameters), self.engine)

    @cached_property
    def _columns(self) -> dict[str, int]:
        """Columns of the outputs: the plan has them in an order of its own."""
        return {str(name): k for k, name in enumerate(self._model.outputs)}

    def at(self, z: FloatArray) -> tuple[Evaluation, FloatArray]:
        """Return the evaluation and the Jacobian (r, n) by z, without the rows of measures, which are 0.

        Raise a NotAssembledError if the design cannot be assembled or does not reach a sample.
        """
        values = self.problem.vector(z)
        parameters = {name: values[name] for name in self.problem.parameters}
        try:
            rows = self._rows(values, parameters)
            measuring = self.measuring
            measured = measuring.values(parameters) if measuring else np.empty(0)
        except RequestError:
            raise
        except KinfmuError as error:
            raise NotAssembledError(str(error)) from None
        lengths = [one.excess(parameters, self.names) for one in self.problem.lengths]
        aims = measuring.aims if measuring else ()
        errors = [
            aim.root * (found - aim.value) for aim, found in zip(aims, measured, strict=True) if aim.value is not None
        ]
        limits = [aim.excess(found)[0] for aim, found in zip(aims, measured, strict=True) if aim.value is None]
        violations = np.concatenate([np.array(limits), *(-met for met, _ in lengths)]) / self._sizes
        roots = self.scale * self.stiffness * self._relative_roots
        penalties = roots * np.maximum(violations + self.shifts, 0.0)
        weighted = [(one.errors * one.target.scale * one.target.roots).ravel() for one in rows]
        targets = np.concatenate([*weighted, np.array(errors)])
        slopes = [-slopes for _, slopes in lengths]
        blocks = [*(one.jacobian for one in rows), np.zeros((len(aims), len(self.names))), *slopes]
        jacobian = np.vstack(blocks) * self._ranges
        first = len(targets) + len(limits)
        active = penalties[len(limits) :] > 0.0
        jacobian[first:] *= (roots[len(limits) :] / self._sizes[len(limits) :] * active)[:, None]
        excess = tuple(met for met, _ in lengths)
        found = Evaluation(
            rows, measured, excess, np.concatenate([targets, penalties]), len(targets), np.asarray(violations)
        )
        return found, jacobian

    @cached_property
    def _relative_roots(self) -> FloatArray:
        """Square roots of the weights of the penalties: of limits of measures, then of Grashof's conditions."""
        lengths = [np.full(one.count, one.root) for one in self.problem.lengths]
        return np.concatenate([np.array([aim.root for aim in self._limited]), *lengths])

    @cached_property
    def _sizes(self) -> FloatArray:
        """What violations are parts of: the larger limit of a measure, or 1; the mean of Grashof's lengths."""
        lengths = [np.full(one.count, one.size) for one in self.problem.lengths]
        return np.concatenate([np.array([aim.size for aim in self._limited]), *lengths])

    @cached_property
    def _limited(self) -> list[Aim]:
        """The measures with limits."""
        return [aim for aim in (self.measuring.aims if self.measuring else ()) if aim.value is None]

    def tighten(self, before: FloatArray, violations: FloatArray) -> bool:
        """Shift the limits by the violations that a search left; return whether another search is worthwhile.

        Where a violation shrank too little since `before`, its penalty grows (Nocedal and Wright 2006, algorithm 17.4).
        """
        shifts = np.maximum(violations + self.shifts, 0.0)
        change = np.abs(shifts - self.shifts)
        slow = (violations > VANISHED) & (violations > SLOW * before)
        ends = change.max(initial=0.0) <= VANISHED or bool(np.any(slow & (self.stiffness >= STIFFEST)))
        self.shifts = np.where(slow, shifts / STIFFER**2, shifts)
        self.stiffness = np.where(slow, self.stiffness * STIFFER, self.stiffness)
        return not ends

    def relax(self) -> None:
        """Undo what `tighten` did."""
        self.shifts, self.stiffness = np.zeros_like(self.shifts), np.ones_like(self.shifts)

    def with_measures(self, z: FloatArray, found: Evaluation, jacobian: FloatArray) -> FloatArray:
        """Return the Jacobian with the rows of measures, which cost two motions for each unknown."""
        measuring = self.measuring
        if measuring is None:
            return jacobian
        ordered = sorted(range(len(measuring.aims)), key=lambda k: measuring.aims[k].value is None)
        start = sum(one.errors.size for one in found.rows)
        factors = {}  # of the slopes of a measure in a row
        for row, k in enumerate(ordered, start=start):
            aim, value = measuring.aims[k], float(found.measured[k])
            if aim.value is not None:
                factors[row, k] = aim.root
            elif found.residuals[row] > 0.0:
                stiffness = self.scale * float(self.stiffness[row - found.target_count])
                factors[row, k] = stiffness * aim.root / aim.size * aim.excess(value)[1]
        if not factors:
            return jacobian
        jacobian = jacobian.copy()
        slopes = measuring.slopes(self._parameters, z, [measuring.aims[k] for _, k in factors])
        for ((row, _), factor), slope in zip(factors.items(), slopes, strict=True):
            jacobian[row] = factor * slope
        return jacobian

    def _parameters(self, z: FloatArray) -> dict[str, float]:
        values = self.problem.vector(z)
        return {name: values[name] for name in self.problem.parameters}

    def _rows(self, values: Mapping[str, float], parameters: Mapping[str, float]) -> tuple[Rows, ...]:
        """Return the errors of the sampled targets and their Jacobian."""
        targets = self.problem.sampled
        if not targets:
            return ()
        arguments = [self._arguments(target, values, parameters) for target in targets]
        u = np.concatenate(arguments)
        found = self._model.sensitivities(
            **self.problem.argument.keywords(u), wrt=self.problem.parameters, parameters=parameters, anew=False
        )
        for reason in found.refused.values():
            raise RequestError(f"[unknowns] {reason}")
        if not np.isfinite(found.values_by).all():
            k = int(np.flatnonzero(~np.isfinite(found.values_by).all(axis=(1, 2)))[0])
            argument = self.problem.argument
            is_angle, unit = argument.quantity.kind == "angle", self.problem.mechanism.length_unit
            at = f"{math.degrees(u[k]):.6g} deg" if is_angle else f"{u[k]:.6g} {unit_of(argument.quantity, unit)}"
            status = Status(int(found.status[k]))
            reason = "cannot reach" if status is Status.OUTSIDE else "has no derivatives at"
            name = status.name.lower().replace("_", " ")
            raise NotAssembledError(f"the design {reason} {argument.name} = {at} (status {int(status)}: {name})")
        ends = np.cumsum([0, *map(len, arguments)])
        return tuple(
            self._row(target, values, u[a:b], found.values[a:b], found.rates[a:b], found.values_by[a:b])
            for target, a, b in zip(targets, ends, ends[1:], strict=False)
        )

    def _row(
        self,
        target: Sampled,
        values: Mapping[str, float],
        u: FloatArray,
        p: FloatArray,
        v: FloatArray,
        by: FloatArray,
    ) -> Rows:
        """Return the errors of a target and its rows of the Jacobian; tables of all outputs at its arguments."""
        k = [self._columns[name] for name in target.outputs]
        value, rate = p[:, k], v[:, k]
        slopes = np.zeros((*value.shape, len(self.names)))
        slopes[:, :, : by.shape[2]] = by[:, k]
        start, offset = _value(target, "start", values), _value(target, "offset", values)
        free = {name: self.names.index(name) for name in target.free}
        if target.over and target.at is not None:
            x = self._columns[target.over]
            ratio = rate / v[:, [x]]
            value = value - ratio * (p[:, [x]] - (target.at + start)[:, None])
            slopes[:, :, : by.shape[2]] -= ratio[:, :, None] * by[:, [x]]
            along = ratio
        else:
            along = rate
        if f"{target.name}.start" in free:
            slopes[:, :, free[f"{target.name}.start"]] = along
        if f"{target.name}.offset" in free:
            slopes[:, :, free[f"{target.name}.offset"]] = -1.0
        errors = value - target.wanted - offset
        errors = modulo(errors, target.periods) if target.at is None else without_turns(errors, target.angles)
        slopes = slopes * target.scale[:, None]
        if target.at is None:
            t = rate * target.scale
            size = np.sqrt((t * t).sum(axis=1, keepdims=True))
            t = np.divide(t, size, out=np.zeros_like(t), where=size > 0.0)
            at_end = np.zeros(len(u), dtype=bool)
            if target.begin is not None or target.end is not None:
                ends = self.problem.argument.values(target.begin, target.end, 2)
                at_end = (u == ends[0]) | (u == ends[1])
            t[at_end] = 0.0  # the nearest point is an end of the path, which does not move along it
            slopes = slopes - t[:, :, None] * np.einsum("md,mdn->mn", t, slopes)[:, None, :]
        slopes = slopes * target.roots[:, :, None]
        return Rows(target, u, value, errors, slopes.reshape(-1, len(self.names)))

    def _arguments(self, target: Sampled, values: Mapping[str, float], parameters: Mapping[str, float]) -> FloatArray:
        """Return the arguments (m,) of the motion at which a target's rows are compared."""
        start = _value(target, "start", values)
        if target.is_timed and target.at is not None:
            return target.at + start
        argument = self.problem.argument
        u = argument.values(target.begin, target.end)
        names = (target.over,) if target.over else target.outputs
        k = [self._columns[name] for name in names]
        scale = np.ones(1) if target.over else target.scale

        def curve(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            run = self._model.solve(**argument.keywords(u), parameters=parameters, anew=False)
            return run.values[:, k] * scale, run.rates[:, k] * scale, run.accelerations[:, k] * scale

        try:
            if target.at is not None:
                return crossings(u, curve, target.at + start)
            is_whole = target.begin is None and target.end is None and argument.is_turn
            wanted = target.wanted * scale
            return nearest(u, curve, wanted, target.periods * scale, None if is_whole else (float(u[0]), float(u[-1])))
        except NotReachedError:
            what = f"{target.over} never has a value of its points" if target.over else "no point of it is reached"
            raise NotAssembledError(f"target '{target.name}': {what}") from None


def _value(target: Sampled, key: str, values: Mapping[str, float]) -> float:
    """Return a start or offset: a number, or the value of an unknown."""
    own: float | Bounds = getattr(target, key)
    return values[f"{target.name}.{key}"] if isinstance(own, Bounds) else own


def without_turns(errors: FloatArray, angles: tuple[bool, ...]) -> FloatArray:
    """Return errors (m, d) of which the angles are shifted by whole turns, the same for all rows of a column."""
    for k, is_angle in enumerate(angles):
        if is_angle:
            errors[:, k] -= math.tau * round(float(errors[:, k].mean()) / math.tau)
    return errors
