"""Steps of the motion of the drivers under efforts: spans between jumps, breaks of laws, and limits.

The integrator restarts where laws of loads over time jump, and where laws over a quantity of the pose have breaks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor, inf
from typing import NamedTuple, Protocol

from ..pose import Pose, Status, Vector
from ..span import Hermite
from .equation_of_motion import Course, StepEnd
from .law_breaks import CUTS, first_crossing, hop, landing, moved_by
from .limits import Ended, is_arrived, limit_past, suspicion, time_to_rest

DETERMINED = 1e-12  # of a span between jumps: laws are read on that side of a jump
ROUNDED = 2e-14  # of the times at its ends: a jump is known so well
MOST = 1000000  # steps of the integrator in one step of the host
REFINED = 2  # times that a suspect step is divided by SHARE, until its interpolation is good enough
SHARE = 4.0
JUST_AFTER = 4e-15  # relative to the numbers from which a jump is computed


def next_jump(t: float, jumps: Sequence[tuple[float, float]]) -> float:
    """Return the first time after t at which a law jumps, infinite if there is none; jumps: times and periods."""
    first = inf
    for jump, period in jumps:
        past = floor((t - jump) / period) if period > 0.0 else 0.0
        for times in (past, past + 1.0)[: 2 if period > 0.0 else 1]:
            at = jump + times * period
            event = at + JUST_AFTER * (abs(jump) + abs(at) + period)
            if event > t:
                first = min(first, event)
                break
    return first


class Laws(NamedTuple):
    """Laws over quantities: how many breaks each has, and a function that gives arguments and breaks at a pose."""

    counts: tuple[int, ...]
    numbers: Callable[[Pose], Vector]


class Integrator(Protocol):
    """An integrator with control of its steps; size: that it would take next [s]."""

    tolerance: float
    size: float

    def begin(self, course: Course, at: StepEnd) -> None:
        """Begin a span."""

    def step(self, course: Course, at: StepEnd, last: float, longest: float) -> StepEnd | None:
        """Return the end of a step, at `last` at the latest; None where no step succeeds."""


class TorqueSteps:
    """The steps of a motion.

    Args:
        course: Gives the poses and the derivatives.
        integrator: Takes the steps.
        laws: Over quantities of the pose, with breaks.
        most: Steps of the integrator, at most.

    Attributes:
        count: Steps of the integrator so far.
        ended: Why the motion ends early; None: it does not.

    """

    def __init__(self, course: Course, integrator: Integrator, laws: Laws, *, most: float = MOST) -> None:
        self._course, self._integrator, self._laws, self._most = course, integrator, laws, most
        self._cuts, self._uncut = 0, 0.0  # how often a step was shortened to end before a break, and its size
        self.count = 0
        self.ended: Ended | None = None

    def run(
        self, pose: Pose, ud: Vector, start: float, end: float, jumps: Sequence[tuple[float, float]]
    ) -> StepEnd | None:
        """Return the state at the end, followed from a pose with speeds ud; None: there is no step."""
        t, y = start, (*pose.u, *ud)
        self._course.here = pose
        at: StepEnd | None = None
        while t < end and self.ended is None:
            last = min(end, next_jump(t, jumps))
            at = self.advance(self.begin(t, y, last), last)
            t, y = at.t, at.y
        return at

    def begin(self, first: float, y: Vector, last: float) -> StepEnd:
        """Return the state at the start of a span without jumps inside, from the last good pose."""
        inside = min(DETERMINED * (last - first) + ROUNDED * (abs(first) + abs(last)), 0.25 * (last - first))
        self._course.low, self._course.high = first + inside, last - inside
        self._longest = self._span = last - first
        self._refined, self._suspect_until = 0, inf
        at = self._course.complete(first, y)
        if at is None:
            at = StepEnd(first, y, (), self._course.here)
            self._fail(at)
        else:
            self._integrator.begin(self._course, at)
        return at

    def advance(self, at: StepEnd, last: float) -> StepEnd:
        """Return the state at a time within the span, or the last one before the motion ends."""
        while at.t < last and self.ended is None:
            self.count += 1
            to = self._integrator.step(self._course, at, last, self._longest) if self.count <= self._most else None
            if to is None:
                self._fail(at)
                break
            end = self._cut(at, to, last) if self._laws.counts else to
            if end is not None and self._is_without_limit(at, end):
                at = end
            self._course.here = at.pose
        return at

    def _cut(self, before: StepEnd, after: StepEnd, last: float) -> StepEnd | None:
        """Return the end of a step, or of a short one past a break; None: the step is repeated up to a break."""
        course, integrator, numbers = self._course, self._integrator, self._laws.numbers
        start, d = numbers(before.pose), len(course.reach)
        crossing = first_crossing(self._laws.counts, start, numbers(after.pose))
        if crossing is None:
            self._cuts = 0
            return after

        def moved(u: Vector) -> float | None:
            pose = course.follow(u)
            return None if pose is None else moved_by(start, numbers(pose), crossing.place)

        def leap(h: float) -> Vector:
            pairs = list(zip(before.y, before.f, strict=True))
            values = [u + h * (v + 0.5 * h * a) for (u, v), a in zip(pairs[:d], before.f[d:], strict=True)]
            return (*values, *(v + h * a for v, a in pairs[d:]))

        course.here = before.pose
        if abs(crossing.away) <= crossing.window:
            speed = max([abs(v) / reach for v, reach in zip(before.y[d:], course.reach, strict=True)])
            h = hop(crossing, lambda h: moved(leap(h)[:d]), speed, last - before.t)
            end = None if h is None else course.complete(before.t + h, leap(h))
            if end is not None:
                integrator.size = self._uncut if self._cuts else integrator.size
                self._cuts = 0
                return end
        elif self._cuts < CUTS:
            ends = (before, after)
            curves = [
                Hermite((before.t, after.t), tuple((e.y[k], e.y[d + k], e.f[d + k]) for e in ends)) for k in range(d)
            ]
            t = landing(crossing, lambda t: moved(tuple([curve(t)[0] for curve in curves])), before.t, after.t)
            if t is not None and before.t < t < after.t:
                self._uncut = self._uncut if self._cuts else after.t - before.t
                self._cuts += 1
                integrator.size = t - before.t
                return None
        course.here = after.pose
        return after

    def _is_without_limit(self, before: StepEnd, after: StepEnd) -> bool:
        """Search a step for a limit, which is the end; False: there is one, or the step is repeated in smaller ones."""
        course = self._course
        solver, ud = course.solver, before.y[len(course.reach) :]
        if self._refined and before.t >= self._suspect_until:  # it had none
            self._take_long_steps()
        if is_arrived(after):
            self.ended = limit_past(solver, after.t + time_to_rest(after), after.pose, ud)
            return self.ended is None
        suspect = suspicion(before, after, course.follow, self._integrator.tolerance)
        if suspect is None:
            return True
        if self._refined < REFINED:
            self._refined += 1
            self._suspect_until = after.t
            self._longest = self._integrator.size = (after.t - before.t) / SHARE
            return False
        if suspect.touches:
            self.ended = limit_past(solver, suspect.t, before.pose if suspect.pose is None else suspect.pose, ud)
        else:
            self._take_long_steps()
        return self.ended is None

    def _take_long_steps(self) -> None:
        self._refined = 0
        self._longest = self._span

    def _fail(self, at: StepEnd) -> None:
        """Set the end where no step succeeds: a limit, or why the motion cannot be integrated."""
        d = len(self._course.reach)
        reason = "the reduced inertia is singular, or a number is not finite"
        if self.count > self._most:
            message = "the motion needs too many steps; take a larger integrator.tolerance"
            self.ended = Ended(at.t, at.y[:d], Status.NOT_CONVERGED, message)
            return
        self.ended = limit_past(self._course.solver, at.t, at.pose, at.y[d:]) or Ended(
            at.t, at.y[:d], Status.NOT_CONVERGED, f"the motion cannot be integrated: {reason}"
        )
