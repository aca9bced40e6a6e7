"""Bridges: interpolation across singular points from both sides, accepted only if the interpolated pose closes.

Near a change point Newton loses digits (the error of q grows like eps / distance, of qd like eps / distance^2, of qdd
like eps / distance^3) and exactly at it two branches meet. The motion itself is smooth there. So inside a window the
unknowns come from the two-sided Hermite polynomial through regular poses outside it: a *bridge*. That the interpolated
pose closes proves that it is a pose of the mechanism: where lengths miss a change point by d, it leaves a gap of d.
"""

from __future__ import annotations

from itertools import pairwise
from math import sqrt
from typing import Any

from .linear import unclosed
from .pose import AT_REST, EPS, UNIT_SPEED, Found, Model, Pose, Status, Vector, evaluated
from .span import Span, restored_span
from .trusted_step import follow_path, passes_unseen

CLOSED = 1e-12  # residual relative to the size up to which an interpolated pose counts as closed
AGREED = 1e-9  # [rad, sizes]; largest difference of two widths, and of a pose and a node whole turns away
DAMPING = 1e-3  # of J dz = -r at a change point: its singular value is 0, the others are far above
NOISE = 8.0  # rounding errors; a residual at the centre that is no larger is no miss
TURN = 6.283185307179586  # [rad]; for counting
_HIGH = 6.2831853069365025  # [rad]; 2 pi to 32 bits, so that its multiples by up to 2^21 turns are exact
_LOW = 2.430840202602477e-10  # [rad]; the rest


def turned(angle: float, turns: float) -> float:
    """Return angle + turns * 2 pi [rad], rounded about once."""
    return angle + turns * _HIGH + turns * _LOW


def whole_turns(angle: float) -> int:
    """Return the whole number of turns nearest to an angle [rad]."""
    return round(angle / TURN)


class Bridge:
    """A span over (low, high), half a width to either side of its centre, moved by whole turns of the driver.

    A mechanism driven by an angle repeats: what was interpolated once also holds after `turns` turns, with each unknown
    angle moved by its own whole turns, `raised`. nodes: the poses of the span, moved.
    """

    __slots__ = ("_miss", "_shifts", "centre", "half", "high", "low", "nodes", "raised", "span", "turns")

    def __init__(self, span: Span, turns: int = 0, raised: tuple[int, ...] = ()) -> None:
        self.span = span
        self._miss: float | None = None  # not known yet
        self.turns = turns
        self.raised = raised
        self._shifts = [(n * _HIGH, n * _LOW) for n in raised]  # as in `turned`
        self.centre = turned(span.centre, turns)
        self.half = span.half
        self.nodes = span.nodes if not turns else [self._moved(node) for node in span.nodes]
        self.low, self.high = self.nodes[2].u[0], self.nodes[3].u[0]  # so that these nodes lie outside, to the bit

    def _moved(self, node: Pose) -> Pose:
        u, z = (turned(node.u[0], self.turns),), self._raised(node.z)
        return Pose(u, evaluated(self.span.model, u, z, held=0))

    def _raised(self, z: Vector) -> Vector:
        return tuple([a + high + low for a, (high, low) in zip(z, self._shifts, strict=True)]) if self.turns else z

    def covers(self, u: float) -> bool:
        """Return whether `u` is inside the window, where the bridge is used."""
        return self.low < u < self.high

    def exit(self, target: float) -> Pose:
        """Return the farthest node on the target's side that does not lie beyond the target."""
        near, far = (3, 4) if target > self.centre else (2, 1)
        passed = abs(target - self.centre) >= abs(self.nodes[far].u[0] - self.centre)
        return self.nodes[far if passed else near]

    def _place(self, u: float) -> float:
        """Return the place of a driver value on the span: x = (u - centre) / half."""
        return (turned(u, -self.turns) - self.span.centre) / self.half

    def pose(self, u: Vector) -> Pose:
        """Return the interpolated pose inside the window; regular blocks are solved from it."""
        z, zd, zdd = self.span.read(self._place(u[0]))
        model, held = self.span.model, self.span.held
        pose = Pose(u, evaluated(model, u, self._raised(z), held))
        pose.bridge = self
        pose.status = Status.BRIDGED
        zd = model.velocity(pose.values, UNIT_SPEED, zd, held)
        pose.tangent = zd, model.acceleration(pose.values, UNIT_SPEED, AT_REST, zd, zdd, held)
        return pose

    def closes(self) -> bool:
        """Return whether the interpolated pose at the centre closes, up to what rounding leaves of large angles."""
        try:
            found = self._middle()
        except (ArithmeticError, ValueError):
            return False
        return bool(found[3] <= CLOSED + 4.0 * EPS * self._largest(found[0])) and self._keeps_distances(found[-1])

    def _middle(self) -> Found:
        """Return the interpolated pose at the centre."""
        return evaluated(self.span.model, (self.centre,), self._raised(self.span.middle()[0]), self.span.held)

    def _largest(self, z: Vector) -> float:
        """Return the largest of the driver value and the unknowns, in radians and sizes."""
        scales = (*self.span.model.REACH, *self.span.model.UNKNOWN_SCALES)
        parts = [abs(a) / c for a, c in zip((self.centre, *z), scales, strict=True)]
        return float(max(self.span.model.ROW_OFFSET, *parts))

    def _keeps_distances(self, values: Any) -> bool:
        """Return whether a driven distance that passes 0 in the window closes as a length: d.d - u^2 always does.

        Two points that pass each other at a distance d give this row a residual of d^2.
        """
        model = self.span.model
        for _, block, row, scale in model.DISTANCES if self.low < 0.0 < self.high else ():
            squared = model.residuals(values)[block][row] * scale + self.centre * self.centre
            if abs(sqrt(max(squared, 0.0)) - abs(self.centre)) > CLOSED * model.SIZE:
                return False
        return True

    def miss(self) -> float:
        """Return by how much lengths miss the change point, relative to the size; 0 within rounding.

        That is the residual at the centre that no change of the unknowns removes: of J dz = -r, damped, the part
        outside the columns of J.
        """
        if self._miss is None:
            model = self.span.model
            found = self._middle()
            jacobians, residuals = model.jacobians(found[-1]), model.residuals(found[-1])
            left = 0.0
            for block, (low, high) in enumerate(model.BLOCKS):
                if self.span.held >> block & 1:
                    scales = model.UNKNOWN_SCALES[low:high]
                    rows = zip(jacobians[block], model.ROW_SCALES[block], strict=True)
                    pure = [[a * c / scale for a, c in zip(row, scales, strict=True)] for row, scale in rows]
                    left = max(left, max(map(abs, unclosed(pure, residuals[block], DAMPING))))
            self._miss = max(0.0, left - NOISE * EPS * (1.0 + self._largest(found[0])))
        return self._miss

    def missed(self, pose: Pose, slope: float) -> tuple[float, float, float]:
        """Return the errors that the miss may cause in unknowns and their derivatives, in radians and sizes.

        Where lengths miss a change point by m, the branches no longer cross: they are sqrt(m) apart at the former
        crossing, and m / x apart at the distance x from it. Their determinant is linear in x, so it gives x more
        exactly than the window's centre.

        Args:
            pose: Interpolated by the bridge.
            slope: Largest derivative of an unknown by the driver.

        """
        e = 2.0 * sqrt(self.miss())
        if e == 0.0:
            return 0.0, 0.0, 0.0
        sides = [node.determinants for node in self.nodes[2:4]]
        parts = [
            2.0 * abs(here) / (abs(before) + abs(after))
            for k, (here, before, after) in enumerate(zip(pose.determinants, *sides, strict=True))
            if self.span.held >> k & 1
        ]
        w = e + min(parts) * self.half / float(self.span.model.REACH[0])
        return e * e / w, 2.0 * max(1.0, slope) * (e / w) ** 2, 8.0 * e * e / w**3

    def difference(self, u: float) -> tuple[Vector, Vector, Vector]:
        """Return the difference of the wider span from the one used, z and two derivatives: the error estimate."""
        return self.span.difference(self._place(u))

    def dump(self) -> list[Any]:
        """Return plain numbers from which `restored_bridge` makes an equal bridge."""
        return [self.span.dump(), self.turns, list(self.raised)]


def restored_bridge(model: Model, data: list[Any]) -> Bridge:
    """Return the bridge that `dump` gave as plain numbers."""
    span, turns, raised = data
    return Bridge(restored_span(model, span), turns, tuple(raised))


def moved(model: Model, bridge: Bridge, pose: Pose, u: float) -> Bridge | None:
    """Return the bridge moved by whole turns, if `u` lies between its moved nodes and the mechanism repeats, else None.

    It repeats if the node next to the pose, reached from it, is the node of the span except for whole turns of angles,
    and if the moved bridge closes. So a bridge of another branch, or of a mechanism with a screw, is not moved.
    """
    span = bridge.span
    turns = whole_turns(u - span.centre)
    place = turned(u, -turns)
    if turns == bridge.turns or not span.nodes[0].u[0] <= place <= span.nodes[-1].u[0]:
        return None
    here = turned(pose.u[0], -turns)
    side = span.nodes[3:] if here > span.centre else span.nodes[:3]
    node = min(side, key=lambda node: abs(node.u[0] - here))
    arrived = follow_path(model, pose, turned(node.u[0], turns))
    if arrived is None:
        return None
    raised = []
    for is_angle, scale, a, b in zip(model.UNKNOWN_IS_ANGLE, model.UNKNOWN_SCALES, arrived.z, node.z, strict=True):
        raised.append(whole_turns(a - b) if is_angle else 0)
        if not abs(a - turned(b, raised[-1])) <= AGREED * scale:
            return None
    try:
        there = Bridge(span, turns, tuple(raised))
    except (ArithmeticError, ValueError):
        return None
    if model.LAW_UNITS and any(
        passes_unseen(model, a, b, UNIT_SPEED, b.u[0] - a.u[0]) for a, b in pairwise(there.nodes)
    ):
        return None  # the laws do not repeat
    return there if there.closes() else None
