"""Steps of the integrator from sample to sample, and the limits that end them.

At a limit of a driver (a dead centre) the reduced inertia grows without bound, and u(t) is a parabola that touches the
limit: steps could cross its top and return on the same branch, where the mechanism itself would not. So every step in
which a speed changes its sign, or a pose is near a singular one, is searched for a pose at a limit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError
from kinfmu.motion.torque.equation import EquationOfMotion
from kinfmu.solver.python import Pose
from kinfmu.solver.python.law_breaks import CUTS, first_crossing, hop, landing, moved_by, wraps
from kinfmu.solver.python.pose import Vector

NEAR = 0.5  # determinant below which steps of several drivers are searched for limits
DIPS = 0.3  # of the determinants at both ends of a step: a smaller one between may be a limit
SUSPECT = 0.3  # determinant at a turning point that may be a limit
REFINED = 2  # times that a suspect step is divided by SHARE, until its interpolation is good enough
SHARE = 4.0
PLACES = 8  # of a step at which the search begins
TOUCHING = 1e-3  # determinant at the turning point that counts as a limit: about 1e-6 rad from it
ARRIVED = 1e-4  # determinant of a pose within about 1e-8 rad of a limit: nearer ones lose digits of the accelerations
ERRORS = 10.0  # tolerances by which the turning point may miss the limit
BEYOND = (1e-6, 1e-4, 1e-2, 0.3)  # [rad, sizes] past a limit, where the solver states why it is one
STEEP = 1.0  # [rad, sizes] that a driver moves in a step at most, if a law's argument is an arc tangent
LEAST_RELATIVE = 100 * float(np.finfo(float).eps)  # error that scipy accepts
DETERMINED = 1e-12  # relative to the span between jumps: laws are read on that side of a jump

METHODS = ("DOP853", "Radau")


class End(NamedTuple):
    """Where a motion ends before its time: u cannot be reached."""

    t: float
    u: Vector
    ud: Vector
    message: str


class Sample(NamedTuple):
    """State and accelerations at a sample."""

    t: float
    u: Vector
    ud: Vector
    udd: Vector


class Step(NamedTuple):
    """One end of a step: time, state, its rates and the pose."""

    t: float
    y: FloatArray
    rates: FloatArray
    pose: Pose


class Stepper:
    """The steps of a motion.

    Args:
        equation: At its initial pose.
        ud: Initial speeds.
        times: (n,) samples [s]; the first is the start.
        jumps: Times inside, at which efforts jump: the integrator restarts there.
        tolerance: Error of a step in rad and sizes, however far drivers have turned; of speeds per second, or relative
            where they are faster than that. Radau's error of angles is relative where they exceed 1 rad.
        method: 'DOP853', or 'Radau' for stiff dampers and springs.

    """

    def __init__(
        self,
        equation: EquationOfMotion,
        ud: Vector,
        times: FloatArray,
        jumps: tuple[float, ...],
        *,
        tolerance: float,
        method: str,
    ) -> None:
        self._equation, self._times, self._tolerance = equation, times, tolerance
        self._jumps, self._method = jumps, method
        self._d = len(ud)
        self._y = np.array([*equation.pose.u, *ud])
        reach = np.array(equation.solver.model.REACH) if self._d == 1 else self._scales()
        self._atol = tolerance * np.concatenate([reach, reach])
        self._rtol: Any = tolerance
        if method == "DOP853":  # Radau's Newton needs one number
            self._rtol = np.repeat([LEAST_RELATIVE, max(tolerance, LEAST_RELATIVE)], self._d)
        self._longest = float(np.diff(times).max()) if len(times) > 1 else inf
        self._refined = 0  # how often the present step was divided
        self._suspect_until = inf  # [s] its end
        self._cut = 0  # how often the present step was shortened
        self._stop = inf  # [s] where a shortened step ends
        self.steps = 0
        self.end: End | None = None

    def samples(self) -> Iterator[Sample]:
        """Yield the samples until the last one, or until the motion ends early: see `end`."""
        times = self._times.tolist()
        yield self._sample(times[0])
        if len(times) == 1:
            return
        edges = [times[0], *self._jumps, times[-1]]
        following = iter(times[1:])
        sample = next(following, None)
        for first, last in pairwise(edges):
            self._start(first, last)
            while sample is not None and sample <= last:
                if not self._advance(sample):
                    return
                yield self._sample(sample)
                sample = next(following, None)
            if not self._advance(last):
                return

    def _scales(self) -> FloatArray:
        """Return 1 rad, or the size of the mechanism, for each driver."""
        size = float(self._equation.solver.model.SIZE)
        kinds = [driver.quantity.kind for driver in self._equation.plan.drivers]
        return np.array([size if kind == "length" else 1.0 for kind in kinds])

    def _start(self, first: float, last: float) -> None:
        """Begin a span of time without jumps inside."""
        inside = DETERMINED * (last - first)
        self._span = (first, last)
        self._inside = (first + inside, last - inside)
        self._restart(first, min(self._longest, last - first))

    def _restart(self, t: float, longest: float) -> None:
        """Begin steps at the present state, none longer than this."""
        from scipy import integrate  # slow to import

        make = getattr(integrate, self._method)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # numbers that are not finite are reported as an end
            self._integrator: Any = make(
                self._rates, t, self._y, self._span[1], rtol=self._rtol, atol=self._atol, max_step=longest
            )

    def _rates(self, t: float, y: FloatArray) -> FloatArray:
        low, high = self._inside
        state = y.tolist()
        u, ud = tuple(state[: self._d]), tuple(state[self._d :])
        found = self._equation.accelerations(min(max(t, low), high), u, ud)
        if found is None:
            return np.full(2 * self._d, np.nan)  # the integrator takes a shorter step
        return np.concatenate([y[self._d :], found])

    def _advance(self, target: float) -> bool:
        """Step to a time; return whether it is reached."""
        while self._integrator.t < target:
            integrator = self._integrator
            integrator.t_bound, integrator.status = min(target, self._stop), "running"
            before = Step(integrator.t, integrator.y.copy(), integrator.f.copy(), self._equation.pose)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                integrator.step()
            self.steps += 1
            if integrator.status == "failed":
                self._fail(before)
                return False
            if self._refined and before.t >= self._suspect_until:  # it had none
                self._take_long_steps()
            if integrator.t >= self._stop:
                self._stop = inf
            after = Step(integrator.t, integrator.y, integrator.f, self._equation.pose)
            if self._equation.law_counts and self._is_cut(before, after):
                continue
            if self._has_limit(before, after):
                return False
        self._y = self._integrator.y.copy()
        return True

    def _is_cut(self, before: Step, after: Step) -> bool:
        """Return whether a step crosses a break of a law: then it is repeated up to that or is a short one."""
        equation, d = self._equation, self._d
        start = equation.law_numbers(before.pose)
        y, rates = before.y, before.rates
        reach = float(np.abs((after.y - y)[:d] / self._scales()).max())
        if reach > STEEP and wraps(equation.law_counts, start):  # turns of an arc tangent are ambiguous
            self._repeat(before, before.t + 0.9 * STEEP / reach * (after.t - before.t))
            return True
        crossing = first_crossing(equation.law_counts, start, equation.law_numbers(after.pose))
        if crossing is None:
            self._cut = 0
            return False

        def moved(u: FloatArray) -> float | None:
            pose = equation.follow(tuple(u.tolist()))
            return None if pose is None else moved_by(start, equation.law_numbers(pose), crossing.place)

        equation.pose = before.pose
        if abs(crossing.away) <= crossing.window:
            speed = float(np.abs(y[d:] / self._scales()).max())
            last = self._integrator.t_bound - before.t
            h = hop(crossing, lambda h: moved(y[:d] + h * (y[d:] + 0.5 * h * rates[d:])), speed, last)
            if h is not None:
                self._y = np.concatenate([y[:d] + h * (y[d:] + 0.5 * h * rates[d:]), y[d:] + h * rates[d:]])
                self._cut, self._stop = 0, inf
                self._restart(before.t + h, self._longest)
                return True
        elif self._cut < CUTS:
            curve = _interpolation(before, after, d)
            t = landing(crossing, lambda t: moved(curve(t)), before.t, after.t)
            if t is not None and before.t < t < after.t:
                self._cut += 1
                self._repeat(before, t)
                return True
        equation.pose = after.pose
        return False

    def _repeat(self, before: Step, end: float) -> None:
        """Take steps to an earlier end in place of a step."""
        self._y, self._stop, self._equation.pose = before.y, end, before.pose
        self._restart(before.t, self._longest)
        self._integrator.h_abs = end - before.t

    def _sample(self, t: float) -> Sample:
        state = self._y.tolist()
        u, ud = tuple(state[: self._d]), tuple(state[self._d :])
        udd = self._equation.accelerations(t, u, ud)
        return Sample(t, u, ud, (np.nan,) * self._d if udd is None else tuple(udd.tolist()))

    def _has_limit(self, before: Step, after: Step) -> bool:
        """Search a step for a limit; return whether there is one, which then is the end.

        A step that may have one is repeated in smaller steps first.
        """
        d, equation = self._d, self._equation
        least = min(before.pose.margin, after.pose.margin)
        if after.pose.margin < ARRIVED and not after.pose.is_bridged:
            return self._ends_at(after.t + _time_to_rest(after, d), after.pose, before.y[d:])
        turns = ((before.y[d:] * after.y[d:] <= 0.0) & (before.y[d:] != 0.0)).any()
        if not (turns if d == 1 else turns or least < NEAR):
            return False
        curve = _interpolation(before, after, d)
        t = _turning(curve, before.t, after.t) if d == 1 else self._singular(curve, before.t, after.t)
        pose = equation.follow(tuple(curve(t).tolist()))
        equation.pose = after.pose
        if pose is not None and (pose.is_bridged or pose.margin > (SUSPECT if d == 1 else DIPS * least)):
            return False
        if self._refined < REFINED:
            self._refined += 1
            self._suspect_until = after.t
            equation.pose, self._y = before.pose, before.y
            self._restart(before.t, (after.t - before.t) / SHARE)
            return False
        if pose is not None and pose.margin > sqrt(max(TOUCHING**2, ERRORS * self._tolerance)):
            self._take_long_steps()
            return False
        return self._ends_at(t, before.pose if pose is None else pose, before.y[d:])

    def _take_long_steps(self) -> None:
        """End the search of a step in smaller ones."""
        self._refined = 0
        self._integrator.max_step = min(self._longest, self._span[1] - self._span[0])

    def _singular(self, curve: Callable[[float], FloatArray], t0: float, t1: float) -> float:
        """Return the time of the smallest determinant within a step."""
        from scipy.optimize import minimize_scalar

        def margin(t: float) -> float:
            pose = self._equation.follow(tuple(curve(t).tolist()))
            return 0.0 if pose is None else float(pose.margin)

        times = np.linspace(t0, t1, PLACES + 1)
        least = int(np.argmin([margin(t) for t in times.tolist()]))
        low, high = times[max(least - 1, 0)], times[min(least + 1, PLACES)]
        found = minimize_scalar(margin, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * (t1 - t0)})
        return float(found.x)

    def _ends_at(self, t: float, pose: Pose, ud: FloatArray) -> bool:
        """Set the end, to driver values just past the limit, and why they are not reached; False: they are reached."""
        solver = self._equation.solver
        largest = float(np.abs(ud / self._scales()).max(initial=0.0)) or 1.0
        for beyond in BEYOND:
            u = tuple((np.array(pose.u) + beyond * ud / largest).tolist())
            refused = solver.solve(pose, u)
            if not refused.good:
                self.end = End(float(t), u, tuple(ud.tolist()), refused.message)
                return True
        return False

    def _fail(self, before: Step) -> None:
        """Set the end where no step succeeds, or raise a RequestError if that is no limit."""
        if not self._ends_at(before.t, before.pose, before.y[self._d :]):
            failed = self._equation.failed
            reason = "the reduced inertia is singular, or a number is not finite" if failed is None else failed.message
            raise RequestError(f"at t = {before.t:.9g} s the motion cannot be integrated: {reason}")


def _interpolation(before: Step, after: Step, d: int) -> Callable[[float], FloatArray]:
    """Return driver values within a step, by their values, speeds and accelerations at both ends."""
    from scipy.interpolate import BPoly

    ends = [[step.y[:d], step.y[d:], step.rates[d:]] for step in (before, after)]
    curve: Callable[[float], FloatArray] = BPoly.from_derivatives([before.t, after.t], ends)
    return curve


def _time_to_rest(step: Step, d: int) -> float:
    """Return how long the fastest driver goes on with its deceleration; 0 if it does not slow down."""
    speeds, slowing = np.abs(step.y[d:]), -step.rates[d:] * np.sign(step.y[d:])
    k = int(np.argmax(speeds))
    return float(speeds[k] / slowing[k]) if slowing[k] > 0.0 else 0.0


def _turning(curve: Any, t0: float, t1: float) -> float:
    """Return when the speed of the only driver changes its sign within a step."""
    from scipy.optimize import brentq

    speed = curve.derivative()
    return float(brentq(lambda t: float(speed(t)[0]), t0, t1, xtol=1e-15 * max(1.0, abs(t1))))
