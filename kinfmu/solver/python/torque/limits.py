"""Limits of the drivers, which end a motion under efforts.

At a limit (a dead centre of a driver) the reduced inertia grows without bound, and u(t) is a parabola that touches the
limit: steps could cross its top and return on the same branch, where the mechanism itself would not. So every step in
which a speed changes its sign, or a pose is near a singular one, is searched for a pose at a limit.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple

from ..pose import Pose, Vector
from ..solver import Solver
from ..span import Hermite
from .equation_of_motion import StepEnd

NEAR = 0.5  # determinant below which steps of several drivers are searched
DIPS = 0.3  # of the determinants at both ends of a step: a smaller one between may be a limit
SUSPECT = 0.3  # determinant at a turning point that may be a limit
PLACES = 8  # of a step at which the search begins
HALVINGS = 60  # of the time of a turning point: to its last digit
SECTIONS = 40  # golden ones, of the time of the smallest determinant
GOLDEN = 0.6180339887498949
TOUCHING = 1e-3  # determinant at the turning point that counts as a limit: about 1e-6 rad from it
ARRIVED = 1e-4  # determinant within about 1e-8 rad of a limit: nearer poses lose digits of the accelerations
ERRORS = 10.0  # tolerances by which the turning point may miss the limit
BEYOND = (1e-6, 1e-4, 1e-2, 0.3)  # [rad, sizes] past a limit, where the solver states why it is one


class Ended(NamedTuple):
    """Where a motion ends before its time, and the status and the reason of poses past it."""

    t: float
    u: Vector
    status: int
    message: str


class Suspicion(NamedTuple):
    """A step that may contain a limit: when, at which pose (None: not reached), and whether that counts as a limit."""

    t: float
    pose: Pose | None
    touches: bool


def limit_past(solver: Solver, t: float, pose: Pose, ud: Vector) -> Ended | None:
    """Return the end of a motion at a pose with speeds ud, if the poses past it are not reached."""
    reach = solver.model.REACH
    largest = max([abs(v) / one for v, one in zip(ud, reach, strict=True)]) or 1.0
    for beyond in BEYOND:
        u = tuple([value + beyond * v / largest for value, v in zip(pose.u, ud, strict=True)])
        refused = solver.solve(pose, u)
        if not refused.good:
            return Ended(t, u, refused.status, f"the motion ends at a limit: {refused.message}")
    return None


def is_arrived(end: StepEnd) -> bool:
    """Return whether a pose is as near to a limit as the accelerations have digits."""
    return end.pose.margin < ARRIVED and not end.pose.is_bridged


def time_to_rest(end: StepEnd) -> float:
    """Return how long the fastest driver goes on with its deceleration; 0 if it does not slow down."""
    d = len(end.y) // 2
    k = max(range(d), key=lambda one: abs(end.y[d + one]))
    v, a = end.y[d + k], end.f[d + k]
    return -v / a if v * a < 0.0 else 0.0


def suspicion(
    before: StepEnd, after: StepEnd, follow: Callable[[Vector], Pose | None], tolerance: float
) -> Suspicion | None:
    """Return the place of a step that may be a limit; None: the step contains none."""
    d = len(before.y) // 2
    least = min(before.pose.margin, after.pose.margin)
    turns = any(v != 0.0 and v * w <= 0.0 for v, w in zip(before.y[d:], after.y[d:], strict=True))
    if not turns and (d == 1 or least >= NEAR):
        return None
    curves = [
        Hermite((before.t, after.t), tuple((end.y[k], end.y[d + k], end.f[d + k]) for end in (before, after)))
        for k in range(d)
    ]
    t = _turning(curves[0], before, after) if d == 1 else _singular(curves, before.t, after.t, DIPS * least, follow)
    if t is None:
        return None
    pose = follow(tuple([curve(t)[0] for curve in curves]))
    margin = 0.0 if pose is None else pose.margin
    if pose is not None and (pose.is_bridged or margin > (SUSPECT if d == 1 else DIPS * least)):
        return None
    return Suspicion(t, pose, margin <= sqrt(max(TOUCHING * TOUCHING, ERRORS * tolerance)))


def _turning(curve: Hermite, before: StepEnd, after: StepEnd) -> float:
    """Return when the speed of the only driver changes its sign within a step."""
    low, high = before.t, after.t
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if curve(middle)[1] * before.y[1] > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _singular(
    curves: list[Hermite], first: float, last: float, low_enough: float, follow: Callable[[Vector], Pose | None]
) -> float | None:
    """Return the time of the smallest determinant within a step; None if it cannot be as low as `low_enough`.

    Towards a limit the determinant is convex, |t - t0| or the root of a square and a little more. So between places it
    lies above the lines through its neighbours: next to place k, above 2 m_k - max(m_k-1, m_k+1).
    """

    def margin(t: float) -> float:
        pose = follow(tuple([curve(t)[0] for curve in curves]))
        return 0.0 if pose is None else pose.margin

    length = last - first
    margins = [margin(first + length * k / PLACES) for k in range(PLACES + 1)]
    place = margins.index(min(margins))
    inner = min(max(place, 1), PLACES - 1)
    if 2.0 * margins[inner] - max(margins[inner - 1], margins[inner + 1]) > low_enough:
        return None
    low, high = first + length * max(place - 1, 0) / PLACES, first + length * min(place + 1, PLACES) / PLACES
    near, far = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    of_near, of_far = margin(near), margin(far)
    for _ in range(SECTIONS):
        if of_near < of_far:
            high, far, of_far = far, near, of_near
            near = high - GOLDEN * (high - low)
            of_near = margin(near)
        else:
            low, near, of_near = near, far, of_far
            far = low + GOLDEN * (high - low)
            of_far = margin(far)
    return 0.5 * (low + high)
