"""Sensitivities of a motion; through bridges they are interpolated across a singular point from both sides, or NaN.

At a change point J is singular, and J z_p = -r_p has a solution only if the parameter keeps the change point: a factor
of all lengths, a parameter that changes two equal lengths, the constants of laws. Then z_p(u) is as smooth there as
z(u). Any other parameter removes the change point: z_p grows as 1 / (u - u*) on both sides, and there is no derivative
at u*.

Hermite interpolations of z_p and its rate, through 6 and through 8 regular poses on both sides, tell one from the
other: they agree where z_p is smooth, and are far apart where it has a pole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.codegen.python.stage import CompiledStage, load_stage
from kinfmu.display import Displayed
from kinfmu.errors import RequestError, listed, suggestion, valid_names
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.plan.steps import law_symbol, scale_of, sensitivity_steps
from kinfmu.plan.trace import parameter_symbol
from kinfmu.run import Run
from kinfmu.run.arguments import Settings
from kinfmu.run.designs import Solvable
from kinfmu.run.stages import Native, native_stage, set_zeros, stage_results
from kinfmu.solver.python.pose import Status

OPEN = 1e-7  # derivative of a row relative to the size, for a change by the size or by 1, above which it would open
_STAGES_KEPT = 16


@dataclass(frozen=True, eq=False)
class Sensitivities(Displayed):
    """Outputs and rates of a motion with their derivatives with respect to parameters.

    Angles are in radians, lengths in the mechanism's unit of length. A derivative is in the output's unit per unit of
    the parameter. Without times, rates and their derivatives are for the driver speeds that were given.

    Attributes:
        outputs: Names of the outputs.
        parameters: Names of the parameters.
        t: (n,) times [s], or sample numbers.
        values: (n, outputs) positions.
        rates: (n, outputs).
        values_by: (n, outputs, parameters) derivatives of the positions.
        rates_by: (n, outputs, parameters) derivatives of the rates.
        status: (n,) of the samples, as in a Run. Numbers of samples with status 0 are exact to round-off; with status
            1, near a singular point, they have fewer digits. Samples with status 2 are interpolated across a singular
            point, within 1e-7 of the largest number nearby. There only parameters that keep the singular point have
            derivatives, such as a factor of all lengths or a law constant; those of other parameters do not exist and
            are NaN, and with several drivers all are. Samples with a status of 3 to 5 are not reached and are NaN.
        refused: Parameters that cannot change by themselves, with the reason: a redundant row would not close. Their
            derivatives are NaN.

    """

    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    t: FloatArray
    values: FloatArray
    rates: FloatArray
    values_by: FloatArray
    rates_by: FloatArray
    status: IntArray
    refused: Mapping[str, str]

    def __repr__(self) -> str:
        names = f"{', '.join(self.outputs)} by {', '.join(self.parameters)}"
        return f"<Sensitivities at {len(self.t)} samples: {names}>"

    def of(self, output: str, parameter: str) -> FloatArray:
        """Return the derivative of an output's position with respect to a parameter, (n,).

        Args:
            output: Name of an output, such as 'coupler.x'.
            parameter: Name of a parameter or of a law constant.

        Returns:
            (n,) in the unit of the output per unit of the parameter, lengths in the mechanism's unit, angles in rad.

        Raises:
            RequestError: The sensitivities do not hold the output or the parameter.

        """
        return self._column(self.values_by, output, parameter)

    def rate_of(self, output: str, parameter: str) -> FloatArray:
        """Return the derivative of an output's rate with respect to a parameter, (n,).

        Args:
            output: Name of an output, such as 'coupler.x'.
            parameter: Name of a parameter or of a law constant.

        Returns:
            (n,) in the unit of the output per second, or per unit of the driver, and per unit of the parameter.

        Raises:
            RequestError: The sensitivities do not hold the output or the parameter.

        """
        return self._column(self.rates_by, output, parameter)

    def _column(self, table: FloatArray, output: str, parameter: str) -> FloatArray:
        for what, name, known in (("output", output, self.outputs), ("parameter", parameter, self.parameters)):
            if name not in known:
                raise RequestError(
                    f"the sensitivities have no {what} '{name}'{suggestion(name, known)}; {what}s: {listed(known)}"
                )
        return table[:, self.outputs.index(output), self.parameters.index(parameter)]


class _Memory(NamedTuple):
    """The memory of sensitivities: all results of a stage.

    is_kept: True if the results that are always 0 are certainly unchanged.
    """

    stage: CompiledStage
    results: FloatArray
    is_kept: bool


class SensitivityModel:
    """Sensitivities of a model; code is printed when it is first needed and kept.

    poses: A model of `plan_of_unknowns`.
    """

    def __init__(self, model: Solvable, poses: Solvable) -> None:
        self._model = model
        self._poses = poses
        unknowns = set(model.plan.unknowns)
        self._unknowns = [
            (k, name, name.derivative(1)) for k, name in enumerate(poses.plan.outputs) if name in unknowns
        ]
        self._symbols = [parameter_symbol(parameter.name) for parameter in model.plan.parameters]
        self._law_symbols = [law_symbol(constant.name) for constant in model.plan.law_constants]
        self._stage = lru_cache(maxsize=_STAGES_KEPT)(self._new_stage)
        self._native = lru_cache(maxsize=_STAGES_KEPT)(native_stage)
        self._memories = WeakKeyDictionary[Sensitivities, _Memory]()

    def solve(
        self,
        t: ArrayLike | None,
        outputs: Sequence[str] | None,
        parameters: Settings | None,
        wrt: Sequence[str] | None,
        *,
        tolerance: float,
        wrap: bool,
        anew: bool,
        reuse: Sensitivities | None,
        inputs: Mapping[str, Any],
    ) -> Sensitivities:
        """Return the sensitivities; arguments and errors as in `Model.sensitivities`."""
        plan, by_law = self._model.plan, not inputs
        names = _names("outputs", outputs, plan.outputs)
        chosen = self._chosen(wrt, by_law=by_law)
        if not (reuse is None or isinstance(reuse, Sensitivities)):
            raise RequestError(f"reuse must be a result of sensitivities or None, not {type(reuse).__name__}")
        given = parameters or {}
        run = self._poses.solve(t, parameters=parameters, tolerance=tolerance, wrap=wrap, anew=anew, **inputs)
        found = self._found(run, names, given, chosen, by_law=by_law, reuse=reuse)
        if len(plan.drivers) > 1 or not (run.status == Status.BRIDGED).any():
            return found

        def again(x: FloatArray) -> Sensitivities:
            times, moved = (x, {}) if by_law else (None, {plan.drivers[0].inputs[0]: x})
            other = self._poses.solve(times, parameters=parameters, tolerance=tolerance, anew=anew, **moved)
            return self._found(other, names, given, chosen, by_law=by_law)

        _fill_bridges(plan, found, run, again, by_law=by_law)
        return found

    def _found(
        self,
        run: Run,
        names: tuple[str, ...],
        settings: Settings,
        chosen: tuple[str, ...],
        *,
        by_law: bool,
        reuse: Sensitivities | None = None,
    ) -> Sensitivities:
        """Return the sensitivities at the samples of a run; NaN where it is interpolated."""
        plan, setting = self._model.plan, self._model.arguments.setting(settings)
        given: dict[str, FloatArray | float] = dict(zip(run.input_names, run.inputs.T, strict=True))
        given["time"] = run.t
        for k, name, rate in self._unknowns:
            given[name] = run.values[:, k]
            given[rate] = run.rates[:, k]
        given |= zip(self._symbols, setting.values or self._model.arguments.written, strict=True)
        given |= zip(self._law_symbols, setting.constants, strict=True)
        stage, gap_names = self._stage(names, chosen, by_law, frozenset(settings))
        native = self._native(stage) if self._poses.is_native(len(run.t)) else None
        memory = None if reuse is None else self._memories.pop(reuse, None)
        found, memory = _evaluated(plan, stage, native, gap_names, names, chosen, run, given, memory)
        if memory is not None:
            self._memories[found] = memory
        return found

    def _chosen(self, wrt: Sequence[str] | None, *, by_law: bool) -> tuple[str, ...]:
        """Return the names of the parameters."""
        plan = self._model.plan
        own = [parameter.name for parameter in plan.parameters]
        constants = [constant.name for constant in plan.law_constants]
        known = [*own, *constants] if by_law else own
        if wrt is not None:  # on constants of the laws of loads no pose depends: derivatives are 0
            known = [*known, *(constant.name for constant in plan.load_constants)]
        for name in wrt or ():
            if name in constants and not by_law:
                raise RequestError(
                    f"wrt: '{name}' is a law constant, which acts over time; give t in place of driver values"
                )
            if name not in known and name in plan.mechanism.parameters:
                self._model.arguments.setting({name: 0.0})  # reports why it is not open
        if not known:
            raise RequestError("the model has no parameters: write [parameters] and use their names for numbers")
        return _names("wrt", wrt, known)

    def _new_stage(
        self, outputs: tuple[str, ...], parameters: tuple[str, ...], by_law: bool, given: frozenset[str]
    ) -> tuple[CompiledStage, tuple[str, ...]]:
        steps = sensitivity_steps(self._model.plan, outputs, parameters, by_law=by_law, given=given)
        return load_stage(steps), steps.gap_names


def plan_of_unknowns(plan: SolvePlan) -> SolvePlan:
    """Return the plan whose outputs are the unknowns of all blocks, seen from its own origin; or the same plan."""
    if set(plan.unknowns) <= set(plan.outputs) and plan.origin == (0.0, 0.0):
        return plan
    local, _ = localized(plan.mechanism)
    open_ones = [parameter.name for parameter in plan.parameters]
    return compile_plan(replace(local, coordinates="moving"), plan.unknowns, open_ones)


def _fill_bridges(
    plan: SolvePlan, found: Sensitivities, run: Run, again: Callable[[FloatArray], Sensitivities], *, by_law: bool
) -> None:
    """Fill the samples of bridges with interpolated numbers where these have derivatives.

    again: the sensitivities at other times, or at driver values at speed 1.
    """
    n, m = found.values.shape
    u, ud = run.inputs[:, 0], run.inputs[:, 1]
    reach = 1.0 if plan.drivers[0].quantity.kind == "angle" else plan.size
    with np.errstate(divide="ignore"):
        spacing = SPACING * reach / (np.abs(ud) if by_law else np.ones(n))
    known = np.full((n, m), np.nan)
    for k, name in enumerate(found.outputs):
        if name in run.outputs:
            known[:, k] = run.values[:, run.outputs.index(name)]
    angles = {name for name in plan.outputs if name.is_angle}
    least = np.array([1.0 if name in angles else plan.size for name in found.outputs])
    scales = np.array([scale_of(plan, name) for name in found.parameters])

    def solve(x: FloatArray) -> Columns:
        other = again(x)
        values = np.concatenate([other.values, other.values_by.reshape(len(x), -1)], axis=1)
        return Columns(values, np.concatenate([other.rates, other.rates_by.reshape(len(x), -1)], axis=1), other.status)

    whole = np.concatenate([least, (least[:, None] / scales).ravel()])
    for group, values, slopes in interpolated(run.t if by_law else u, spacing, found.status, known, whole, solve):
        speed = 1.0 if by_law else ud[group, None]
        found.values[group], found.rates[group] = values[:, :m], slopes[:, :m] * speed
        found.values_by[group] = values[:, m:].reshape(len(group), m, -1)
        found.rates_by[group] = (slopes[:, m:] * speed).reshape(len(group), m, -1)


def _names(what: str, wanted: Sequence[str] | None, known: Sequence[str]) -> tuple[str, ...]:
    """Return the names wanted, each once; default: all that are known."""
    if wanted is None:
        return tuple(known)
    if isinstance(wanted, str):
        raise RequestError(f"{what}: '{wanted}' must be a list of names, such as ['{wanted}']")
    for name in wanted:
        if name not in known:
            raise RequestError(f"{what}: '{name}' is not known{valid_names(name, known, 'valid')}")
    return tuple(dict.fromkeys(wanted))


def _evaluated(
    plan: SolvePlan,
    stage: CompiledStage,
    native: Native | None,
    gap_names: Sequence[str],
    outputs: tuple[str, ...],
    parameters: tuple[str, ...],
    run: Run,
    given: Mapping[str, FloatArray | float],
    memory: _Memory | None,
) -> tuple[Sensitivities, _Memory | None]:
    """Return what a stage gives for the samples of a run that hold numbers and are not interpolated, and its memory.

    memory: of sensitivities that are no longer needed; it is used if it fits. None is returned for tables of their own.
    """
    good = np.flatnonzero(run.status < Status.BRIDGED)
    n, m, p, rows = len(good), len(outputs), len(parameters), len(gap_names)
    shapes = ((m,), (m,), (m, p), (m, p), (p, rows))
    ends = np.cumsum([0, *(math.prod(shape) for shape in shapes)])
    is_whole = n == len(run.t)
    numbers = [given[name] for name in stage.given]
    if not is_whole:
        numbers = [number[good] if isinstance(number, np.ndarray) else number for number in numbers]
    shape = (int(ends[-1]), n)
    into = memory.results if memory is not None and memory.stage is stage and memory.results.shape == shape else None
    if memory is not None and into is not None and not memory.is_kept:
        set_zeros(stage, into)
    results, is_finite = stage_results(stage, native, numbers, shape, into=into)
    tables = [
        np.moveaxis(results[a:b].reshape(*shape, n), -1, 0) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)
    ]
    *tables, gaps = tables
    refused = _refused(plan, parameters, gap_names, gaps, run.status[good])
    if not is_finite:
        results[~np.isfinite(results)] = np.nan
    for name in refused:
        for table in tables[2:]:
            table[:, :, parameters.index(name)] = np.nan
    if not is_whole:
        whole = [np.full((len(run.t), *table.shape[1:]), np.nan) for table in tables]
        for there, table in zip(whole, tables, strict=True):
            there[good] = table
        tables = whole
    elif into is not None:
        for table in tables:
            table.flags.writeable = False
    values, rates, values_by, rates_by = tables
    found = Sensitivities(outputs, parameters, run.t, values, rates, values_by, rates_by, run.status, refused)
    is_kept = into is not None and is_finite and not refused
    return found, _Memory(stage, results, is_kept) if is_whole else None


def _refused(
    plan: SolvePlan, parameters: Sequence[str], rows: Sequence[str], gaps: FloatArray, status: IntArray
) -> dict[str, str]:
    """Return the parameters whose change would open a row, with the reason; gaps: (n, parameters, rows)."""
    if not rows:
        return {}
    if (status == Status.OK).any():
        gaps = gaps[status == Status.OK]
    largest = np.abs(gaps).max(axis=0, initial=0.0) * [[scale_of(plan, name)] for name in parameters]
    return {
        name: f"'{name}' cannot change by itself: redundant row {rows[int(of.argmax())]} would not close"
        for name, of in zip(parameters, largest, strict=True)
        if of.max() > OPEN
    }


SPACING = 0.0125  # [rad, sizes] between poses; windows are at most 0.1 wide on either side
POSES = 20  # on either side, of which the nearest regular ones count
FEW, MANY = 3, 4  # poses on either side of the two interpolations
AGREED = 1e-7  # largest difference of the two, as a part of the largest number interpolated
SAME = 1e-8  # likewise of the interpolated and the solved positions: a larger one is another branch


class Columns(NamedTuple):
    """Numbers at samples (n,) and their derivatives with respect to the driver value or time; (n, columns) each."""

    values: FloatArray
    slopes: FloatArray
    status: IntArray


def interpolated(
    x: FloatArray,
    spacing: FloatArray,
    status: IntArray,
    known: FloatArray,
    least: FloatArray,
    solve: Callable[[FloatArray], Columns],
) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield for each bridge its samples, with the interpolated columns and their slopes, (samples, columns) each.

    Args:
        x: (n,) driver values or times.
        spacing: (n,) of the poses, in the unit of x.
        status: (n,) of the samples.
        known: (n, m) positions that the first m columns must have; NaN: unknown.
        least: (columns,) numbers that count as 1 of a column; smaller columns are judged by them.
        solve: Gives the columns at any x; their numbers are used where the status is 0.

    Returns:
        Samples of each bridge and their columns; NaN where a column has no derivative.

    """
    from scipy.interpolate import KroghInterpolator  # slow to import, and few motions need it

    bridged = np.flatnonzero((status == Status.BRIDGED) & np.isfinite(spacing) & (spacing > 0.0))
    bridged = bridged[np.argsort(x[bridged], kind="stable")]
    steps = np.arange(1, POSES + 1)
    for group in np.split(bridged, np.flatnonzero(np.diff(x[bridged]) > spacing[bridged[1:]]) + 1):
        if len(group) == 0:
            continue
        step = float(spacing[group].min())
        there = np.concatenate([x[group[0]] - step * steps[::-1], x[group[-1]] + step * steps])
        found = solve(there)
        regular = found.status == Status.OK
        before, after = np.flatnonzero(regular[:POSES])[::-1], POSES + np.flatnonzero(regular[POSES:])
        if min(len(before), len(after)) < MANY:
            continue
        middle = 0.5 * float(x[group[0]] + x[group[-1]])
        places = (x[group] - middle) / step
        results = []
        for count in (FEW, MANY):
            nodes = np.stack([before[:count], after[:count]], axis=1).ravel()
            curve = KroghInterpolator(
                np.repeat((there[nodes] - middle) / step, 2),
                np.stack([found.values[nodes], found.slopes[nodes] * step], axis=1).reshape(4 * count, -1),
            )
            values, slopes = curve.derivatives(places, der=2)
            results.append((values, slopes / step))
        (rough, rough_slopes), (values, slopes) = results
        nodes = np.concatenate([before[:MANY], after[:MANY]])
        largest = np.maximum(np.abs(found.values[nodes]).max(axis=0), least)
        fastest = np.maximum(np.abs(found.slopes[nodes]).max(axis=0), largest * (SPACING / step))
        good = (np.abs(values - rough) <= AGREED * largest).all(axis=0)
        good &= (np.abs(slopes - rough_slopes) <= AGREED * fastest).all(axis=0)
        m = known.shape[1]
        good &= not (np.abs(values[:, :m] - known[group]) > SAME * largest[:m]).any()
        yield group, np.where(good, values, np.nan), np.where(good, slopes, np.nan)
