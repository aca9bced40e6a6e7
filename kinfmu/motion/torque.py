"""Motion of a mechanism whose drivers apply given efforts: torques and forces in place of laws of motion.

efforts: numbers, laws, functions, tables -> equation: accelerations of the drivers -> steps over time -> Run
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from math import inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.forces import load_forces
from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError, listed, suggestion, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.laws.law import Jumps
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.efforts import effort_inputs, inertia_steps, led_laws, units_in_si
from kinfmu.run import MOST_SAMPLES, Event, Run
from kinfmu.run.axis import TIME
from kinfmu.run.continued import Settings, continued
from kinfmu.run.driving import applied_efforts, numbers_of
from kinfmu.run.forces import ForceModel, LoadedRun, force_plan
from kinfmu.run.model import Model
from kinfmu.run.verdict import coarse_samples
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Status, Vector
from kinfmu.solver.python.solver import LEAST_TOLERANCE, MOST_TOLERANCE, STEP_TOLERANCE
from kinfmu.solver.python.torque import (
    Course,
    DormandPrince,
    Ended,
    EquationOfMotion,
    Given,
    Laws,
    StepEnd,
    TorqueSteps,
)

_VALID = "a number, a law of time, a function of t or of (t, state), or an array with 'time'"

State = Mapping[str, float]  # values and speeds of the drivers by the names of their inputs
Effort = Callable[[float, State], float]


class Efforts(NamedTuple):
    """Efforts by the names of their inputs, and the times at which they jump."""

    by_name: Mapping[str, Effort]
    jumps: tuple[float, ...]

    def at(self, t: float, state: State) -> tuple[float, ...]:
        """Return all efforts [N, N m]; raise a RequestError if one is not a finite number."""
        efforts = tuple([effort(t, state) for effort in self.by_name.values()])
        for name, value in zip(self.by_name, efforts, strict=True):
            if not isfinite(value):
                raise RequestError(f"{name} = {value} at t = {t:g} s must be a finite number")
        return efforts


def read_efforts(known: Sequence[str], given: Mapping[str, Any], span: tuple[float, float]) -> Efforts:
    """Return the efforts of inputs, 0 where none is given, for a span of time.

    Raise a RequestError if a name is unknown or a value is invalid.
    """
    for name in given:
        if name != TIME and name not in known:
            raise RequestError(f"input '{name}' is not known{valid_names(name, known, 'inputs')}")
    jumps: set[float] = set()
    times = _times(given[TIME]) if TIME in given else None
    by_name = {}
    for name in known:
        value = given.get(name, 0.0)
        if is_number(value):
            by_name[name] = _constant(float(value))
        elif isinstance(value, Law) and not isinstance(value, External):
            value.check(name)
            by_name[name] = _of_law(value)
            jumps.update(_within(value.own_breaks(), span))
        elif callable(value):
            by_name[name] = _function(name, value)
        elif times is not None and not isinstance(value, str):
            by_name[name] = _table(name, times, value)
            jumps.update(t for t in times.tolist() if span[0] < t < span[1])
        else:
            raise RequestError(f"{name} = {quoted(value)} must be {_VALID}")
    return Efforts(by_name, tuple(sorted(jumps)))


def jumps_of_loads(loads: Sequence[Load], span: tuple[float, float]) -> set[float]:
    """Return the times at which laws of loads over time jump."""
    found: set[float] = set()
    for load in loads:
        law = getattr(load, "law", None)
        if law is not None and getattr(load, "over", None) is None:
            found.update(_within(law.own_breaks(), span))
    return found


def _within(jumps: Jumps, span: tuple[float, float]) -> Iterator[float]:
    """Yield the times of jumps inside a span."""
    first, last = span
    period = float(jumps.period)
    for at in map(float, jumps.at):
        if not period > 0.0:
            yield from (at,) * (first < at < last)
            continue
        if (last - first) / period > MOST_SAMPLES:
            raise RequestError(f"a law that repeats every {period:g} s jumps more than {MOST_SAMPLES} times in the run")
        low, high = np.ceil((first - at) / period), np.floor((last - at) / period)
        yield from (t for t in (at + k * period for k in range(int(low), int(high) + 1)) if first < t < last)


def _constant(value: float) -> Effort:
    return lambda t, state: value  # noqa: ARG005  a constant depends on neither


def _of_law(law: Law) -> Effort:
    return lambda t, state: float(law.at(t))  # noqa: ARG005  laws are over time


def _function(name: str, function: Callable[..., Any]) -> Effort:
    """Return a function of t, or of t and the state, as one of both."""
    try:
        parameters = inspect.signature(function).parameters.values()
        required = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
        count = len([p for p in required if p.default is p.empty]) or min(len(required), 1)
    except (TypeError, ValueError):  # functions of C libraries may have no signature
        count = 1
    if count not in (1, 2):
        raise RequestError(f"{name}: the function must take t, or t and the state, not {count} arguments")

    def effort(t: float, state: State) -> float:
        value = function(t) if count == 1 else function(t, state)
        try:
            return float(value)
        except (TypeError, ValueError):
            raise RequestError(f"{name} = {quoted(value)} at t = {t:g} s must be a finite number") from None

    return effort


def _times(values: Any) -> Any:
    times = numbers_of("time", values)
    if times.ndim != 1 or len(times) == 0 or not np.isfinite(times).all() or not (np.diff(times) > 0.0).all():
        raise RequestError("time must be finite numbers that increase")
    return times


def _table(name: str, times: Any, values: Any) -> Effort:
    column = numbers_of(name, values, _VALID)
    if column.shape != times.shape or not np.isfinite(column).all():
        raise RequestError(f"{name} must have {len(times)} finite numbers, one for each time")
    return lambda t, state: float(np.interp(t, times, column))  # noqa: ARG005  tables are over time


class Sample(NamedTuple):
    """State and accelerations at a sample."""

    t: float
    u: Vector
    ud: Vector
    udd: Vector


class IntegratedMotion:
    """The motion of the drivers of a plan under efforts.

    Args:
        plan: A plan of `force_plan`, without parameters.
        efforts: Of the drivers, in their order, and then of external loads.
        tolerance: Error of a step in rad and sizes, however far drivers have turned; of speeds per second, or relative
            where they are faster than that. Radau's error of angles is relative where they exceed 1 rad.
        method: 'DOP853', or 'Radau' for stiff dampers and springs.

    Attributes:
        limit: Why the motion ends early, after the last sample; None: it does not.
        speeds: Of the drivers at the limit.

    """

    def __init__(self, plan: SolvePlan, efforts: Efforts, *, tolerance: float, method: str) -> None:
        self._plan, self._efforts = plan, efforts
        self._equation = EquationOfMotion(load_forces(plan, inertia_steps(plan)), units_in_si(plan))
        self._state_names: list[str] = [name for driver in plan.drivers for name in driver.inputs[:2]]
        self._constants: Vector = tuple(constant.value for constant in plan.load_constants)
        self._course = Course(Solver(load_model(plan)), self._accelerations)
        laws = led_laws(plan)
        law_numbers = load_forces(plan, laws.steps)
        loads = (0.0,) * (len(efforts.by_name) - len(plan.drivers)) + self._constants

        def numbers(pose: Pose) -> Vector:
            return law_numbers(0.0, pose.u, (), (), pose.z, (), (), (), loads, ())

        self._steps = TorqueSteps(self._course, METHODS[method](tolerance), Laws(laws.counts, numbers), most=inf)
        self.limit: Ended | None = None
        self.speeds: Vector = ()

    @property
    def step_count(self) -> int:
        """Number of the integrator's steps."""
        return self._steps.count

    def samples(self, u: Vector, ud: Vector, times: Sequence[float]) -> Iterator[Sample]:
        """Yield the samples until the last one, or until the motion ends early.

        Raise a RequestError if the initial pose is not reached, a driver moves no mass, or the motion cannot be
        integrated.

        u: Initial values of the drivers. ud: Their initial speeds. times: Of the samples [s]; the first is the start.
        """
        course, steps, d = self._course, self._steps, len(u)
        pose = course.solver.solve(course.here, u)
        if not pose.good:
            raise RequestError(f"the initial state: {pose.message}")
        course.here = pose
        self._require_inertia(times[0], pose, ud)
        yield self._sample(times[0], pose, ud)
        y = (*u, *ud)
        following = iter(times[1:])
        time = next(following, None)
        for first, last in pairwise([times[0], *self._efforts.jumps, times[-1]] if time is not None else []):
            at = steps.begin(first, y, last)
            while time is not None and time <= last:
                at = steps.advance(at, time)
                if steps.ended is not None:
                    break
                inside = first < time < last  # at a jump the efforts after it count
                yield Sample(time, at.y[:d], at.y[d:], at.f[d:]) if inside else self._sample(time, at.pose, at.y[d:])
                time = next(following, None)
            at = steps.advance(at, last)
            if steps.ended is not None:
                self._end(steps.ended, at.y[d:])
                return
            y = at.y

    def _end(self, ended: Ended, ud: Vector) -> None:
        """Set the limit, or raise a RequestError if it is none."""
        if ended.status == Status.NOT_CONVERGED:
            refused = self._course.refused
            why = ended.message if refused is None else f"the motion cannot be integrated: {refused.message}"
            raise RequestError(f"at t = {ended.t:.9g} s {why}")
        self.limit, self.speeds = ended, ud

    def _given(self, t: float, pose: Pose, ud: Vector) -> Given:
        d = len(ud)
        state = dict(zip(self._state_names, [x for pair in zip(pose.u, ud, strict=True) for x in pair], strict=True))
        efforts = self._efforts.at(t, state)
        return Given(efforts[:d], efforts[d:] + self._constants, ())

    def _accelerations(self, t: float, pose: Pose, ud: Vector) -> Vector | None:
        return self._equation.accelerations(self._course.solver, pose, t, ud, self._given(t, pose, ud))

    def _sample(self, t: float, pose: Pose, ud: Vector) -> Sample:
        return Sample(t, pose.u, ud, self._accelerations(t, pose, ud) or (nan,) * len(ud))

    def _require_inertia(self, t: float, pose: Pose, ud: Vector) -> None:
        """Raise a RequestError if drivers move no mass."""
        massless = self._equation.massless(self._course.solver, pose, t, ud, self._given(t, pose, ud))
        if massless:
            raise RequestError(
                f"driver {listed(self._plan.drivers[k].name for k in massless)}: its reduced inertia is 0, so that "
                "efforts do not determine its motion; give a body that it moves a mass or an inertia"
            )


class Radau:
    """The integrator; scipy's object begins anew wherever a step does not start at the end of the one before.

    tolerance: Error of a step in rad and sizes; that of angles is relative where they exceed 1 rad.

    size: That the integrator would take next [s]; 0: chosen by scipy.
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance, self.size = tolerance, 0.0
        self._end: StepEnd | None = None

    def begin(self, course: Course, at: StepEnd) -> None:
        """Begin a span."""

    def step(self, course: Course, at: StepEnd, last: float, longest: float) -> StepEnd | None:
        """Return the end of a step, at `last` at the latest; None where no step succeeds."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # numbers that are not finite are reported as an end
            if at is not self._end:
                self._start(course, at, last, longest)
            scipys = self._integrator
            scipys.t_bound, scipys.status, scipys.max_step = last, "running", longest
            scipys.step()
        if scipys.status == "failed":
            course.here = at.pose
            return None
        self.size = scipys.h_abs
        self._end = course.complete(scipys.t, tuple(scipys.y.tolist()))
        return self._end

    def _start(self, course: Course, at: StepEnd, last: float, longest: float) -> None:
        from scipy.integrate import Radau as ScipysRadau  # slow to import

        def derive(t: float, y: FloatArray) -> FloatArray:
            f = course.derive(t, tuple(y.tolist()))
            return np.full(len(y), np.nan) if f is None else np.array(f)  # the integrator takes a shorter step

        scales = self.tolerance * np.array(course.reach * 2)
        first = min(self.size, last - at.t) or None
        self._integrator: Any = ScipysRadau(
            derive, at.t, np.array(at.y), last, rtol=self.tolerance, atol=scales, max_step=longest, first_step=first
        )


METHODS = {"DOP853": DormandPrince, "Radau": Radau}


def torque_driven(
    mechanism: Mechanism,
    times: FloatArray,
    *,
    inputs: Mapping[str, Any] | None = None,
    state: Mapping[str, float] | None = None,
    parameters: Settings | None = None,
    tolerance: float | None = None,
    method: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Run:
    """Integrate the motion of a mechanism under efforts of its drivers.

        J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

    Args:
        mechanism: The mechanism, with masses.
        times: (n,) of the samples [s], increasing; the first is the start.
        inputs: Efforts by the names of inputs, such as crank_torque [N m] or wind_force [N]; 0 by default.
        state: Initial values and speeds, such as crank_angle [rad] and crank_speed [rad/s]. Default: of the laws.
        parameters: Values of parameters and law constants, as in `solve`.
        tolerance: Error of a step in rad and sizes, for fast speeds relative; 1e-13 to 1e-4. Default: 1e-9.
        method: 'DOP853', or 'Radau' for stiff dampers and springs. Default: 'DOP853'.
        progress: Called with (samples done, number of samples).

    Returns:
        The run over time. A motion that reaches a limit ends there: its last sample has the status and no numbers, and
        an event of level "error" states driver, value and limit.

    Raises:
        RequestError: A name is unknown, a value is invalid, or a driver moves no mass.
        KinfmuError: The mechanism cannot be solved.

    """
    tolerance = STEP_TOLERANCE if tolerance is None else tolerance
    method = "DOP853" if method is None else method
    if not (is_number(tolerance) and LEAST_TOLERANCE <= tolerance <= MOST_TOLERANCE):
        raise RequestError(f"tolerance = {quoted(tolerance)} must be {LEAST_TOLERANCE:g} to {MOST_TOLERANCE:g}")
    if method not in METHODS:
        raise RequestError(f"method {quoted(method)} is not known{suggestion(method, METHODS)}; {listed(METHODS)}")
    require_masses(mechanism)
    changed = continued(mechanism, parameters or {})
    plan = compile_plan(changed.mechanism, None, [])
    ends = (float(times[0]), float(times[-1]))
    efforts = read_efforts(effort_inputs(plan), inputs or {}, ends)
    jumps = sorted({*efforts.jumps, *jumps_of_loads(changed.mechanism.loads, ends)})
    efforts = efforts._replace(jumps=tuple(jumps))
    u, ud = _initial_state(plan, ends[0], state or {})
    motion = IntegratedMotion(force_plan(plan), efforts, tolerance=float(tolerance), method=method)
    samples = []
    for sample in motion.samples(u, ud, times.tolist()):
        samples.append(sample)
        if progress is not None:
            progress(len(samples), len(times))
    events = [Event(ends[0], "info", changed.message)] if changed.message else []
    t, values, speeds = (np.array([sample[k] for sample in samples]) for k in range(3))
    coarse = coarse_samples(t, [driver.inputs[0] for driver in plan.drivers], values, speeds)
    if coarse:
        events.append(Event(ends[0], "info", coarse))
    limit = motion.limit
    if limit is not None:
        samples.append(Sample(limit.t, limit.u, motion.speeds, (0.0,) * len(u)))
        events.append(Event(limit.t, "error", f"at t = {limit.t:.9g} s {limit.message}"))
    run = _run(Model(plan), samples, efforts, tuple(events), ended=limit is not None)
    about = {"drive": "torque", "method": method, "tolerance": repr(float(tolerance)), "steps": str(motion.step_count)}
    return run.replaced(info={**run.info, **about})


def _initial_state(plan: SolvePlan, start: float, given: Mapping[str, float]) -> tuple[Vector, Vector]:
    """Return values and speeds of the drivers at the start."""
    known = [name for driver in plan.drivers for name in driver.inputs[:2]]
    for name, value in given.items():
        if name not in known:
            raise RequestError(f"state '{name}' is not known{valid_names(name, known, 'states')}")
        if not (is_number(value) and np.isfinite(value)):
            raise RequestError(f"{name} = {quoted(value)} must be a finite number")
    u, ud, _ = load_model(plan).drive(start, tuple(constant.value for constant in plan.law_constants))
    values, speeds = (
        tuple(float(given.get(driver.inputs[order], one)) for driver, one in zip(plan.drivers, by_law, strict=True))
        for order, by_law in enumerate((u, ud))
    )
    return values, speeds


def _run(model: Model, samples: list[Sample], efforts: Efforts, events: tuple[Event, ...], *, ended: bool) -> Run:
    """Return the run of samples: solved at their driver values, with the forces over time."""
    t = np.array([sample.t for sample in samples])
    u, ud, udd = (np.array([sample[order] for sample in samples]) for order in (1, 2, 3))  # (n, d)
    inputs: dict[str, Any] = {
        name: table[:, k]
        for k, driver in enumerate(model.plan.drivers)
        for name, table in zip(driver.inputs, (u, ud, udd), strict=True)
    }
    loads = list(efforts.by_name)[len(model.plan.drivers) :]
    applied = _load_efforts(model.plan, samples, efforts) if loads else {}
    poses = model if force_plan(model.plan) is model.plan else Model(force_plan(model.plan))
    forces = ForceModel(poses)

    def loaded() -> LoadedRun:
        solved, setting = run if poses is model else poses.solve(**inputs), model.arguments.setting({})
        return LoadedRun(solved, (u, ud, udd), True, setting, applied_efforts(loads, applied, len(t)), t)

    run = model.solve(**inputs)
    if ended:  # the limit, however near the last sample is to it
        run = run.replaced(status=np.append(run.status[:-1], max(int(run.status[-1]), int(Status.OUTSIDE))))
    return run.replaced(
        t=t,
        axis=TIME,
        events=events,
        forces=lambda: forces.forces(loaded()),
        reactions=lambda: forces.reactions(loaded()),
        shaking=lambda: forces.shaking(loaded()),
    )


def _load_efforts(plan: SolvePlan, samples: list[Sample], efforts: Efforts) -> dict[str, FloatArray]:
    """Return the efforts of external loads at the samples, by name."""
    names = [name for driver in plan.drivers for name in driver.inputs[:2]]
    rows = []
    for sample in samples:
        pairs = (x for pair in zip(sample.u, sample.ud, strict=True) for x in pair)
        rows.append(efforts.at(sample.t, dict(zip(names, pairs, strict=True))))
    table = np.array(rows)
    return {name: table[:, k] for k, name in enumerate(efforts.by_name) if k >= len(plan.drivers)}
