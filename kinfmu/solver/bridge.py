"""Bridges: across a singular point by interpolation from both sides, proved by closing.

Near a change point Newton loses digits (the error of q grows like eps / distance, of qd like eps / distance^2, of qdd
like eps / distance^3) and exactly at it two branches meet. The motion itself is smooth there. So inside a window the
unknowns come from the two-sided Hermite polynomial through regular poses outside it. That the interpolated pose closes
proves that it is a pose of the mechanism: where lengths miss a change point by d, it stays open by d.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .hermite import Hermite, weights
from .pose import ALONE, AT_REST, Model, Pose, Vector, evaluated, tangent_of
from .status import Status

HALF_WIDTH = 0.05  # [rad, sizes]; twice as wide loses four digits on the antiparallelogram
NARROWEST = 1e-3  # [rad, sizes]; nodes closer than this have lost the digits that a bridge would win
CLOSED = 1e-12  # residual relative to the size up to which an interpolated pose counts as closed
AGREED = 1e-9  # largest difference of two widths in z
REGULAR = 0.25  # determinant from which a block inside a window is solved as elsewhere
STEADY = 0.1  # largest correction of an extrapolation over the determinant: beyond it lies another branch
_PLACES = (-4.0, -2.0, -1.0, 1.0, 2.0, 4.0)  # of the nodes, in half widths
_INNER = _PLACES[1:5]
_OUTER = (*_PLACES[:2], *_PLACES[4:])

Walk = Callable[[Pose, float], "Pose | None"]  # from a pose to a driver value, plainly


class Bridge:
    """The unknowns of singular blocks over (low, high) = centre -+ half, for a single driver.

    nodes: six poses at -4, -2, -1, 1, 2, 4 half widths; held: bit a block that is interpolated. The inner four nodes
    give the numbers, the outer four a second opinion: their difference is the error estimate.
    """

    __slots__ = ("_inner", "_outer", "centre", "half", "held", "high", "low", "model", "nodes")

    def __init__(self, model: Model, centre: float, half: float, nodes: list[Pose]) -> None:
        self.model = model
        self.centre = centre
        self.half = half
        self.low, self.high = centre - half, centre + half
        self.nodes = nodes
        self.held = 0
        for block in range(len(model.BLOCKS)):
            if min(abs(nodes[2].determinants[block]), abs(nodes[3].determinants[block])) < REGULAR:
                self.held |= 1 << block
        self._inner: list[Hermite] | None = None  # made when first read: many bridges are only crossed
        self._outer: list[Hermite] | None = None

    def covers(self, u: float) -> bool:
        """True inside the window, where the bridge is used."""
        return self.low < u < self.high

    def exit(self, target: float) -> Pose:
        """The farthest node on the target's side that does not lie beyond the target."""
        away = (target - self.centre) / self.half
        node = (4 if away >= 2.0 else 3) if away > 0.0 else (1 if away <= -2.0 else 2)
        return self.nodes[node]

    def pose(self, u: Vector) -> Pose:
        """The interpolated pose inside the window; blocks that are regular are solved from it."""
        if self._inner is None:
            self._inner = _polynomials(self.model, self.half, _INNER, self.nodes[1:5])
        z, zd, zdd = _read(self._inner, (u[0] - self.centre) / self.half, self.half)
        return self._at(u, z, zd, zdd)

    def _at(self, u: Vector, z: Vector, zd: Vector, zdd: Vector) -> Pose:
        model = self.model
        pose = Pose(u, evaluated(model, u, z, self.held))
        pose.bridge = self
        pose.status = Status.BRIDGED
        zd = model.velocity(pose.values, ALONE, zd, self.held)
        pose.tangent = zd, model.acceleration(pose.values, ALONE, AT_REST, zd, zdd, self.held)
        return pose

    def proved(self) -> bool:
        """True if the interpolated pose at the centre closes and both widths agree there."""
        inner = _combined(self.model, self.half, weights(_INNER, 0.0), self.nodes[1:5])
        outer = _combined(self.model, self.half, weights(_OUTER, 0.0), [*self.nodes[:2], *self.nodes[4:]])
        if max(abs(a - b) for a, b in zip(inner, outer, strict=True)) > AGREED:
            return False
        try:
            return bool(evaluated(self.model, (self.centre,), inner, self.held)[3] <= CLOSED)
        except (ArithmeticError, ValueError):
            return False

    def disagreement(self, u: float) -> tuple[float, float, float]:
        """Largest difference of the two widths in z and its two derivatives: the error estimate."""
        if self._inner is None:
            self._inner = _polynomials(self.model, self.half, _INNER, self.nodes[1:5])
        if self._outer is None:
            self._outer = _polynomials(self.model, self.half, _OUTER, [*self.nodes[:2], *self.nodes[4:]])
        x = (u - self.centre) / self.half
        a, b = _read(self._inner, x, self.half), _read(self._outer, x, self.half)
        largest = [max((abs(p - q) for p, q in zip(v, w, strict=True)), default=0.0) for v, w in zip(a, b, strict=True)]
        return largest[0], largest[1], largest[2]

    def dump(self) -> list[Any]:
        """Plain numbers from which `restored` makes the same bridge."""
        return [self.centre, self.half, [[list(node.u), list(node.z)] for node in self.nodes]]


def restored(model: Model, data: list[Any]) -> Bridge:
    """The bridge that was dumped."""
    centre, half, nodes = data
    return Bridge(model, centre, half, [Pose(tuple(u), evaluated(model, tuple(u), tuple(z))) for u, z in nodes])


def build(model: Model, pose: Pose, block: int, zero: float, walk: Walk) -> Bridge | None:
    """A bridge over the zero of a block's determinant that a regular pose has before it, or None if none proves itself.

    A dead centre gives no bridge: the far side cannot be reached, or the interpolated pose does not close.
    """
    reach: float = model.REACH[0]
    half = HALF_WIDTH * reach
    while half >= NARROWEST * reach:
        bridge = _spanned(model, pose, block, zero, half, walk)
        if bridge is not None:
            return bridge
        half *= 0.5
    return None


def _spanned(model: Model, pose: Pose, block: int, centre: float, half: float, walk: Walk) -> Bridge | None:
    """A bridge of one width; its centre is found by the secant rule on the determinant, on the near side only."""
    side = 1.0 if centre > pose.u[0] else -1.0
    for _ in range(4):
        near = [pose]
        for distance in (4.0, 2.0, 1.0):
            arrived = walk(near[-1], centre - side * distance * half)
            if arrived is None:
                return None
            near.append(arrived)
        better = secant_zero(near[-2], near[-1], block)
        if better is None or abs(better - centre) > 2.0 * half:
            return None
        if abs(better - centre) <= 0.2 * half:
            break
        centre = better
    else:
        return None
    near = near[1:]
    far = _crossed(model, centre, half, side, near)
    if far is None or near[-1].determinants[block] * far[0].determinants[block] >= 0.0:
        return None  # not reached, or touched and not crossed: no change point of two smooth branches
    nodes = near + far if side > 0.0 else (near + far)[::-1]
    bridge = Bridge(model, centre, half, nodes)
    return bridge if bridge.proved() else None


def zero_near(pose: Pose, block: int, walk: Walk, reach: float) -> float | None:
    """Driver value near a pose where a block's determinant seems to vanish, by its slope on the regular side."""
    for offset in (0.02 * reach, -0.02 * reach):
        other = walk(pose, pose.u[0] + offset)
        if other is not None and abs(other.determinants[block]) > abs(pose.determinants[block]):
            return secant_zero(other, pose, block)
    return None


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
        guess = _combined(model, side * half, ahead, poses[-4:])
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


def _polynomials(model: Model, half: float, places: tuple[float, ...], poses: Sequence[Pose]) -> list[Hermite]:
    """One polynomial an unknown, over x = (u - centre) / half; the derivatives are with respect to x."""
    tangents = [tangent_of(model, pose) for pose in poses]
    return [
        Hermite(
            places,
            tuple(
                (pose.z[k], zd[k] * half, zdd[k] * half * half)
                for pose, (zd, zdd) in zip(poses, tangents, strict=True)
            ),
        )
        for k in range(len(model.UNKNOWNS))
    ]


def _combined(model: Model, half: float, by: Sequence[Vector], poses: Sequence[Pose]) -> Vector:
    """z of the Hermite polynomials at a place whose weights are known."""
    total = [0.0] * len(model.UNKNOWNS)
    for pose, (w0, w1, w2) in zip(poses, by, strict=True):
        zd, zdd = tangent_of(model, pose)
        w1, w2 = w1 * half, w2 * half * half
        total = [t + w0 * a + w1 * b + w2 * c for t, a, b, c in zip(total, pose.z, zd, zdd, strict=True)]
    return tuple(total)


def _read(polynomials: list[Hermite], x: float, half: float) -> tuple[Vector, Vector, Vector]:
    """z and its two derivatives with respect to the driver at x."""
    per_x = 1.0 / half
    values = [polynomial(x) for polynomial in polynomials]
    return (
        tuple(value for value, _, _ in values),
        tuple(slope * per_x for _, slope, _ in values),
        tuple(curve * per_x * per_x for _, _, curve in values),
    )
