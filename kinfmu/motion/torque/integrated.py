"""The motion of a mechanism under efforts as samples over time, or up to the limit that ends it; scipy's Radau."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf, nan
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.forces import load_forces
from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError, listed
from kinfmu.motion.torque.efforts import Efforts
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import inertia_steps, led_laws, units_in_si
from kinfmu.solver.python import Pose, Solver, Status
from kinfmu.solver.python.pose import Vector
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
