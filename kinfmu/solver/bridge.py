"""Bridges: across a singular point by interpolation from both sides, proved by closing.

Near a change point Newton loses digits (the error of q grows like eps / distance, of qd like eps / distance^2, of qdd
like eps / distance^3) and exactly at it two branches meet. The motion itself is smooth there. So inside a window the
unknowns come from the two-sided Hermite polynomial through regular poses outside it. That the interpolated pose closes
proves that it is a pose of the mechanism: where lengths miss a change point by d, it stays open by d.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .hermite import weights
from .pose import ALONE, AT_REST, EPS, Model, Pose, Vector, evaluated
from .span import Span, combined, restored_span
from .status import Status
from .turns import turned, whole_turns

HALF_WIDTH = 0.05  # [rad, sizes]; twice as wide loses four digits on the antiparallelogram
NARROWEST = 1e-3  # [rad, sizes]; nodes closer than this have lost the digits that a bridge would win
CLOSED = 1e-12  # residual relative to the size up to which an interpolated pose counts as closed
AGREED = 1e-9  # [rad, sizes]; largest difference of two widths, and of a pose and a node turns away
FINE = 1e-12  # [rad, sizes]; difference of two widths from which narrower ones win nothing
STRAIGHT = 0.1  # change of a zero located anew, as a part of what is left to go: as little where there is a zero
STEADY = 0.1  # largest correction of an extrapolation over the determinant: beyond it lies another branch

Walk = Callable[[Pose, float], "Pose | None"]  # from a pose to a driver value, plainly


class Bridge:
    """A span over (low, high), half a width to either side of its centre, moved by whole turns of the driver.

    A mechanism driven by an angle repeats: what was interpolated once holds `turns` turns on, with each unknown angle
    moved by its own whole turns, `raised`. nodes: the poses of the span, moved.
    """

    __slots__ = ("centre", "half", "high", "low", "nodes", "raised", "span", "turns")

    def __init__(self, span: Span, turns: int = 0, raised: tuple[int, ...] = ()) -> None:
        self.span = span
        self.turns = turns
        self.raised = raised
        self.centre = turned(span.centre, turns)
        self.half = span.half
        self.nodes = span.nodes if not turns else [self._moved(node) for node in span.nodes]
        self.low, self.high = self.nodes[2].u[0], self.nodes[3].u[0]  # so that these nodes lie outside, to the bit

    def _moved(self, node: Pose) -> Pose:
        u, z = (turned(node.u[0], self.turns),), self._raised(node.z)
        return Pose(u, evaluated(self.span.model, u, z, held=0))

    def _raised(self, z: Vector) -> Vector:
        return tuple([turned(a, n) for a, n in zip(z, self.raised, strict=True)]) if self.turns else z

    def covers(self, u: float) -> bool:
        """True inside the window, where the bridge is used."""
        return self.low < u < self.high

    def exit(self, target: float) -> Pose:
        """The farthest node on the target's side that does not lie beyond the target."""
        near, far = (3, 4) if target > self.centre else (2, 1)
        passed = abs(target - self.centre) >= abs(self.nodes[far].u[0] - self.centre)
        return self.nodes[far if passed else near]

    def _place(self, u: float) -> float:
        """Where a driver value lies on the span: x = (u - centre) / half."""
        return (turned(u, -self.turns) - self.span.centre) / self.half

    def pose(self, u: Vector) -> Pose:
        """The interpolated pose inside the window; blocks that are regular are solved from it."""
        z, zd, zdd = self.span.read(self._place(u[0]))
        model, held = self.span.model, self.span.held
        pose = Pose(u, evaluated(model, u, self._raised(z), held))
        pose.bridge = self
        pose.status = Status.BRIDGED
        zd = model.velocity(pose.values, ALONE, zd, held)
        pose.tangent = zd, model.acceleration(pose.values, ALONE, AT_REST, zd, zdd, held)
        return pose

    def closes(self) -> bool:
        """True if the interpolated pose at the centre closes, up to what rounding leaves of large angles."""
        u, z = (self.centre,), self._raised(self.span.middle()[0])
        try:
            residual = evaluated(self.span.model, u, z, self.span.held)[3]
        except (ArithmeticError, ValueError):
            return False
        scales = (*self.span.model.REACH, *self.span.model.UNKNOWN_SCALES)
        largest = max([abs(a) / c for a, c in zip((self.centre, *z), scales, strict=True)])
        return bool(residual <= CLOSED + 4.0 * EPS * largest)

    def difference(self, u: float) -> tuple[Vector, Vector, Vector]:
        """What the wider span says less than the one used, in z and its two derivatives: the error estimate."""
        return self.span.difference(self._place(u))

    def dump(self) -> list[Any]:
        """Plain numbers from which `restored` makes the same bridge."""
        return [self.span.dump(), self.turns, list(self.raised)]


def restored(model: Model, data: list[Any]) -> Bridge:
    """The bridge that was dumped."""
    span, turns, raised = data
    return Bridge(restored_span(model, span), turns, tuple(raised))


def moved(bridge: Bridge, pose: Pose, u: float, walk: Walk) -> Bridge | None:
    """The same bridge whole turns on, if a driver value lies between its nodes there and the mechanism repeats.

    It repeats if the node next to the pose, reached from it, is the node of the span but for whole turns of angles, and
    if the moved bridge closes. So a bridge of another branch, or of a mechanism that has a screw in it, is not moved.
    """
    span = bridge.span
    model = span.model
    turns = whole_turns(u - span.centre)
    place = turned(u, -turns)
    if turns == bridge.turns or not span.nodes[0].u[0] <= place <= span.nodes[-1].u[0]:
        return None
    here = turned(pose.u[0], -turns)
    side = span.nodes[3:] if here > span.centre else span.nodes[:3]
    node = min(side, key=lambda node: abs(node.u[0] - here))
    arrived = walk(pose, turned(node.u[0], turns))
    if arrived is None:
        return None
    raised = []
    for name, scale, a, b in zip(model.UNKNOWNS, model.UNKNOWN_SCALES, arrived.z, node.z, strict=True):
        raised.append(whole_turns(a - b) if name.endswith(".phi") else 0)
        if not abs(a - turned(b, raised[-1])) <= AGREED * scale:
            return None
    try:
        there = Bridge(span, turns, tuple(raised))
    except (ArithmeticError, ValueError):
        return None
    return there if there.closes() else None


def build(model: Model, pose: Pose, block: int, zero: float, walk: Walk) -> Bridge | None:
    """A bridge over the zero of a block's determinant that a regular pose has before it, or None if none proves itself.

    zero: a first estimate. Windows shrink until they hold one point and its six nodes, and both widths agree. Then the
    closing decides: where lengths miss a change point, no narrower window would close. A dead centre gives no bridge:
    the determinant does not fall to zero straight, the far side cannot be reached.
    """
    reach: float = model.REACH[0]
    centre = _located(pose, block, zero, walk, reach)
    if centre is None:
        return None
    half, best, apart = HALF_WIDTH * reach, None, AGREED
    while half >= NARROWEST * reach and apart > FINE:
        span = _spanned(model, pose, block, centre, half, walk)
        if span is not None and span.apart() < apart:
            best, apart = span, span.apart()
        half *= 0.5
    if best is None:
        return None
    bridge = Bridge(best)
    return bridge if bridge.closes() else None


def _located(pose: Pose, block: int, zero: float, walk: Walk, reach: float) -> float | None:
    """Where a block's determinant vanishes, by the secant rule from the near side; None if it does not fall straight.

    Towards a dead centre it falls like a square root: the secant's zero stays beyond, by as much as is left to go.
    """
    step = 0.5 * (zero - pose.u[0])
    whole = False  # the first estimate may stem from the same two places
    while abs(step) > 0.1 * NARROWEST * reach:
        ahead = walk(pose, pose.u[0] + step)
        if ahead is None:
            step, whole = 0.5 * step, False
            continue
        better = secant_zero(pose, ahead, block)
        if better is None or (better - ahead.u[0]) * step <= 0.0:
            return None
        change = abs(better - zero)
        if whole and change <= STRAIGHT * abs(better - ahead.u[0]) and change <= 0.2 * NARROWEST * reach:
            return better
        pose, zero, whole = ahead, better, True
        step = 0.5 * (zero - pose.u[0])
    return None


def _spanned(model: Model, pose: Pose, block: int, centre: float, half: float, walk: Walk) -> Span | None:
    """A span of one width over the zero of a block's determinant, from the side that the pose is on."""
    side = 1.0 if centre > pose.u[0] else -1.0
    near: list[Pose] = []
    for distance in (4.0, 2.0, 1.0):
        arrived = walk(near[-1] if near else pose, centre - side * distance * half)
        if arrived is None:
            return None
        near.append(arrived)
    far = _crossed(model, centre, half, side, near)
    if far is None:
        return None
    if near[-1].determinants[block] * far[0].determinants[block] >= 0.0 and block not in model.TALL:
        return None  # touched and not crossed: no change point of two smooth branches
    return Span(model, centre, half, near + far if side > 0.0 else (near + far)[::-1])


def secant_zero(a: Pose, b: Pose, block: int) -> float | None:
    """Driver value where the determinant of a block vanishes on the secant through two poses."""
    rise = b.determinants[block] - a.determinants[block]
    return None if rise == 0.0 else b.u[0] - b.determinants[block] * (b.u[0] - a.u[0]) / rise


def _crossed(model: Model, centre: float, half: float, side: float, near: list[Pose]) -> list[Pose] | None:
    """Poses at 1, 2, 4 half widths on the far side: each extrapolated from the last known ones, then corrected."""
    places = [-4.0, -2.0, -1.0]  # seen in the direction of the crossing
    poses = list(near)
    for distance in (1.0, 2.0, 4.0):
        ahead = weights(tuple(places[-4:]), distance)
        u = (centre + side * distance * half,)
        guess = combined(model, side * half, ahead, poses[-4:])
        try:
            pose = Pose(u, evaluated(model, u, guess, held=0))
        except (ArithmeticError, ValueError):
            return None
        if pose.moved > STEADY * pose.margin:
            return None
        if distance > 1.0 and any(a * b <= 0.0 for a, b in zip(pose.determinants, poses[-1].determinants, strict=True)):
            return None  # there is another zero beside the one to be bridged
        places.append(distance)
        poses.append(pose)
    return poses[3:]
