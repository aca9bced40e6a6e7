"""The motion of the drivers under efforts, over one step of the host. The FMU has a copy: standard library only.

Steps of order 8 with error estimates of orders 5 and 3. They restart where laws of loads over time jump, and where
laws over a quantity of the pose have breaks. Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I,
section II.10.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor, inf, sqrt
from typing import NamedTuple

from ..solver.python import Pose, Solver, Status
from ..solver.python.hermite import Hermite
from ..solver.python.law_breaks import CUTS, first_crossing, hop, landing, moved_by
from . import dormand_prince as pair
from .equation_of_motion import EquationOfMotion, Given
from .slave.layout import Numbers
from .torque_limits import Ended, StepEnd, is_arrived, limit_past, suspicion, time_to_rest

SAFETY = 0.9
SHRINKS = 0.2  # a step is at least so much of the refused one
GROWS = 10.0  # and at most so much of the one before
STEEP = 1.0  # reaches that a driver moves in a step at most, so that no limit is passed in it
FIRST = 0.01  # reaches that it moves in the first step
DETERMINED = 1e-12  # of a span between jumps: laws are read on that side of a jump
ROUNDED = 2e-14  # of the times at its ends: a jump is known so well
LEAST = 10.0 * 2.220446049250313e-16  # of the time: a step is at least so long
MOST = 1000000  # steps of the integrator in one step of the host
REFINED = 2  # times that a suspect step is divided by SHARE, until its interpolation is good enough
SHARE = 4.0
JUST_AFTER = 4e-15  # relative to the numbers from which a jump is computed

_A = tuple(tuple((j, a) for j, a in enumerate(row) if a) for row in pair.A)  # of stages that count
_B, _E3, _E5 = (tuple((j, b) for j, b in enumerate(row) if b) for row in (pair.B, pair.E3, pair.E5))


def next_jump(t: float, jumps: Sequence[tuple[float, float]]) -> float:
    """Return the first time after t at which a law jumps, infinite if there is none; jumps: times and periods."""
    found = inf
    for jump, period in jumps:
        past = floor((t - jump) / period) if period > 0.0 else 0.0
        for times in (past, past + 1.0)[: 2 if period > 0.0 else 1]:
            at = jump + times * period
            event = at + JUST_AFTER * (abs(jump) + abs(at) + period)
            if event > t:
                found = min(found, event)
                break
    return found


class EmittedLaws(NamedTuple):
    """Laws over quantities: how many breaks each has, and an emitted function that gives arguments and breaks."""

    counts: tuple[int, ...]
    numbers: Callable[..., Numbers]


class TorqueSteps:
    """The steps of a motion from a good pose.

    Args:
        equation: Gives the accelerations.
        solver: Gives the poses.
        given: By the host, constant during its step.
        laws: Over quantities of the pose, with breaks.
        tolerance: Error of a step, relative, and absolute in rad and sizes, per second for speeds.
        size: Of the first step [s]; 0: from speeds and accelerations.

    Attributes:
        size: That the integrator would take next.
        ended: Why the motion ends early; None: it does not.

    """

    def __init__(
        self,
        equation: EquationOfMotion,
        solver: Solver,
        given: Given,
        laws: EmittedLaws,
        *,
        tolerance: float,
        size: float,
    ) -> None:
        self._laws = laws
        self._cuts, self._uncut = 0, 0.0  # how often a step was shortened to end before a break, and its size
        self._equation, self._solver, self._given, self._tolerance = equation, solver, given, tolerance
        self._reach: Numbers = solver.model.REACH
        self._scales = self._reach * 2
        self._count = 0
        self.size = size
        self.ended: Ended | None = None

    def run(
        self, pose: Pose, ud: Numbers, start: float, end: float, jumps: Sequence[tuple[float, float]]
    ) -> StepEnd | None:
        """Return the state at the end, followed from a pose with speeds ud; None where the motion ends before."""
        t, y = start, (*pose.u, *ud)
        self._pose = pose
        at: StepEnd | None = None
        while t < end:
            last = min(end, next_jump(t, jumps))
            inside = min(DETERMINED * (last - t) + ROUNDED * (abs(t) + abs(last)), 0.25 * (last - t))
            self._low, self._high = t + inside, last - inside
            self._longest = self._span = last - t
            self._refined, self._suspect_until = 0, inf
            at = self._complete(t, y)
            if at is None:
                self._fail(StepEnd(t, y, (), self._pose))
                return None
            self.size = self.size or self._size_for(at, FIRST)
            at = self._advance(at, last)
            if at is None:
                return None
            t, y = at.t, at.y
        return at

    def _derive(self, t: float, y: Numbers) -> Numbers | None:
        """Return the derivative of a state; the pose is followed from the last good one."""
        d = len(self._reach)
        pose = self._solver.solve(self._pose, y[:d])
        if not pose.good:
            return None
        self._pose = pose
        at = min(max(t, self._low), self._high)
        udd = self._equation.accelerations(self._solver, pose, at, y[d:], self._given)
        return None if udd is None else (*y[d:], *udd)

    def _complete(self, t: float, y: Numbers) -> StepEnd | None:
        f = self._derive(t, y)
        return None if f is None else StepEnd(t, y, f, self._pose)

    def _follow(self, u: Numbers) -> Pose | None:
        pose = self._solver.solve(self._pose, u)
        if not pose.good:
            return None
        self._pose = pose
        return pose

    def _attempt(self, at: StepEnd, h: float, t: float) -> tuple[float, StepEnd | None]:
        """Return the error of a step of size h to t (1: that allowed; infinite: a pose is not reached), and its end."""
        k, n = [at.f], range(len(at.y))
        for c, row in zip(pair.C[1:], _A[1:], strict=True):
            y = tuple([at.y[i] + h * sum([a * k[j][i] for j, a in row]) for i in n])
            f = self._derive(at.t + c * h, y)
            if f is None:
                return inf, None
            k.append(f)
        y = tuple([at.y[i] + h * sum([b * k[j][i] for j, b in _B]) for i in n])
        fifth = third = 0.0
        for i in n:
            scale = self._scales[i]
            if 2 * i >= len(y):
                scale = max(scale, abs(at.y[i]), abs(y[i]))
            fifth += (sum([e * k[j][i] for j, e in _E5]) / scale) ** 2
            third += (sum([e * k[j][i] for j, e in _E3]) / scale) ** 2
        error = fifth + 0.01 * third
        error = h * fifth / sqrt(error * len(y)) / self._tolerance if error > 0.0 else 0.0
        if not error < 1.0:
            return error, None
        end = self._complete(t, y)
        return (inf if end is None else error), end

    def _size_for(self, at: StepEnd, share: float) -> float:
        """Return the size of a step in which no driver moves by more than `share` of its reach."""
        d, fastest = len(self._reach), 0.0
        for k in range(d):
            reach = share * self._reach[k]
            fastest = max(fastest, abs(at.y[d + k]) / reach + sqrt(abs(at.f[d + k]) / reach))
        return 1.0 / fastest if fastest > 0.0 else inf

    def _advance(self, at: StepEnd, last: float) -> StepEnd | None:
        """Step to the end of a span without jumps."""
        while at.t < last:
            least = LEAST * max(abs(at.t), abs(last))
            h = min(self.size, self._longest, self._size_for(at, STEEP))
            refused = False
            self._count += 1
            while True:
                is_last = h >= last - at.t - least
                h = last - at.t if is_last else h
                error, to = self._attempt(at, h, last if is_last else at.t + h) if self._count <= MOST else (inf, None)
                if to is not None:
                    break
                self._pose = at.pose
                refused = True
                h *= max(SHRINKS, SAFETY * error ** (-1.0 / pair.ORDER)) if error < inf else SHRINKS
                if not h > least or self._count > MOST:
                    self._fail(at)
                    return None
            grown = h * (min(GROWS, SAFETY * error ** (-1.0 / pair.ORDER)) if error > 0.0 else GROWS)
            self.size = min(h, grown) if refused else max(grown, self.size) if is_last else grown
            if self._laws.counts:
                cut = self._cut(at, to, last)
                if cut is None:
                    self._pose = at.pose
                    continue
                to = cut
            is_accepted = self._is_without_limit(at, to)
            if self.ended is not None:
                return None
            at = to if is_accepted else at
            self._pose = at.pose
        return at

    def _law_numbers(self, pose: Pose) -> Numbers:
        return self._laws.numbers(0.0, pose.u, (), (), pose.z, (), (), (), self._given.loads, self._given.parameters)

    def _cut(self, before: StepEnd, after: StepEnd, last: float) -> StepEnd | None:
        """Return the end of a step, or of a short one past a break; None: the step is repeated up to a break."""
        start, d = self._law_numbers(before.pose), len(self._reach)
        crossing = first_crossing(self._laws.counts, start, self._law_numbers(after.pose))
        if crossing is None:
            self._cuts = 0
            return after

        def moved(u: Numbers) -> float | None:
            pose = self._follow(u)
            return None if pose is None else moved_by(start, self._law_numbers(pose), crossing.place)

        def leap(h: float) -> Numbers:
            pairs = list(zip(before.y, before.f, strict=True))
            values = [u + h * (v + 0.5 * h * a) for (u, v), a in zip(pairs[:d], before.f[d:], strict=True)]
            return (*values, *(v + h * a for v, a in pairs[d:]))

        self._pose = before.pose
        if abs(crossing.away) <= crossing.window:
            speed = max([abs(v) / one for v, one in zip(before.y[d:], self._reach, strict=True)])
            h = hop(crossing, lambda h: moved(leap(h)[:d]), speed, last - before.t)
            end = None if h is None else self._complete(before.t + h, leap(h))
            if end is not None:
                self.size = self._uncut if self._cuts else self.size
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
                self.size = t - before.t
                return None
        self._pose = after.pose
        return after

    def _is_without_limit(self, before: StepEnd, after: StepEnd) -> bool:
        """Search a step for a limit, which is the end; False: there is one, or the step is repeated in smaller ones."""
        d, solver = len(self._reach), self._solver
        ud = before.y[d:]
        if self._refined and before.t >= self._suspect_until:  # it had none
            self._take_long_steps()
        if is_arrived(after):
            self.ended = limit_past(solver, after.t + time_to_rest(after), after.pose, ud)
            return self.ended is None
        found = suspicion(before, after, self._follow, self._tolerance)
        if found is None:
            return True
        if self._refined < REFINED:
            self._refined += 1
            self._suspect_until = after.t
            self._longest = self.size = (after.t - before.t) / SHARE
            return False
        if found.touches:
            self.ended = limit_past(solver, found.t, before.pose if found.pose is None else found.pose, ud)
        else:
            self._take_long_steps()
        return self.ended is None

    def _take_long_steps(self) -> None:
        self._refined = 0
        self._longest = self._span

    def _fail(self, at: StepEnd) -> None:
        """Set the end where no step succeeds: a limit, or why the motion cannot be integrated."""
        d = len(self._reach)
        reason = "the reduced inertia is singular, or a number is not finite"
        if self._count > MOST:
            message = "the motion needs too many steps; take a larger integrator.tolerance"
            self.ended = Ended(at.t, at.y[:d], Status.NOT_CONVERGED, message)
            return
        self.ended = limit_past(self._solver, at.t, at.pose, at.y[d:]) or Ended(
            at.t, at.y[:d], Status.NOT_CONVERGED, f"the motion cannot be integrated: {reason}"
        )
