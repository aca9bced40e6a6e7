"""Singularity map: the singular points known so far, and how a survey finds them and bridges them."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

from .bridge import AGREED, Bridge, moved, restored_bridge
from .pose import UNIT_SPEED, Model, Pose, evaluated
from .span import REGULAR, Span, combined, weights
from .trusted_step import follow_path, passes_unseen

_KEPT = 32  # of each kind, the latest; a full turn should find what the turn before it has found
NEXT_TO = 1e-3  # [rad, sizes] up to which the secant through two poses is too rough to find a zero by
FAR_OFF = 4.0  # times as far as zeros are bridged: one that the rough secant has beyond is not searched for
HALF_WIDTH = 0.05  # [rad, sizes]; twice as wide loses four digits on the antiparallelogram
NARROWEST = 1e-3  # [rad, sizes]; nodes closer than this have lost the digits that a bridge would gain
FINE = 1e-12  # [rad, sizes]; difference of two widths below which narrower ones gain nothing
STRAIGHT = 0.1  # change of a zero located anew, as a part of the distance ahead: it is as small where there is a zero
STEADY = 0.1  # largest correction of an extrapolation over the determinant: beyond it lies another branch


class Interval(NamedTuple):
    """Driver values between which a block's determinant was searched for a zero: none is bridged there."""

    low: float
    high: float
    block: int


class SingularityMap:
    """Bridges and searched intervals of one driver, the latest last.

    A value: each pose refers to the map that was known when it was found. Between `low` and `high`, which hold the
    driver value of that pose, there is no window of a bridge.
    """

    __slots__ = ("bridges", "high", "low", "searched")

    def __init__(
        self,
        bridges: tuple[Bridge, ...] = (),
        searched: tuple[Interval, ...] = (),
        low: float = -inf,
        high: float = inf,
    ) -> None:
        self.bridges = bridges
        self.searched = searched
        self.low = low
        self.high = high

    def around(self, u: float) -> SingularityMap:
        """Return the same map with the limits of the window-free interval around `u`; inside a window it is empty."""
        low, high = -inf, inf
        for bridge in self.bridges:
            if bridge.covers(u):
                low, high = inf, -inf
                break
            if bridge.centre < u:
                low = max(low, bridge.high)
            else:
                high = min(high, bridge.low)
        return SingularityMap(self.bridges, self.searched, low, high)

    def with_bridge(self, bridge: Bridge, u: float) -> SingularityMap:
        """Return the map around `u` with one more bridge, which replaces one of the same span."""
        others = [known for known in self.bridges if known.span is not bridge.span]
        return SingularityMap((*others, bridge)[-_KEPT:], self.searched).around(u)

    def with_interval(self, interval: Interval, blocks: int) -> SingularityMap:
        """Return the map with one more searched interval; at one place there may be one for each of the blocks."""
        searched = (*self.searched, interval)[-_KEPT - blocks :]
        return SingularityMap(self.bridges, searched, self.low, self.high)

    def knows(self, u: float, block: int) -> bool:
        """Return whether a zero of a block's determinant near `u` need not be searched for.

        Between its outermost nodes a bridge spans all zeros.
        """
        for bridge in self.bridges:
            if bridge.nodes[0].u[0] <= u <= bridge.nodes[-1].u[0]:
                return True
        for interval in self.searched:  # noqa: SIM110
            if interval.block == block and interval.low <= u <= interval.high:
                return True
        return False

    def next_bridge(self, here: float, target: float) -> Bridge:
        """Return the bridge whose window holds `here`, else the nearest one towards the target."""
        for bridge in self.bridges:
            if bridge.covers(here):
                return bridge
        beyond = [bridge for bridge in self.bridges if (bridge.centre > here) == (target > here)]
        return min(beyond, key=lambda bridge: abs(bridge.centre - here))

    def dump(self) -> list[Any]:
        """Return plain numbers from which `restored_map` makes an equal map."""
        return [[bridge.dump() for bridge in self.bridges], [list(interval) for interval in self.searched]]


def restored_map(model: Model, data: list[Any]) -> SingularityMap:
    """Return the map that `dump` gave as plain numbers."""
    bridges, searched = data
    return SingularityMap(
        tuple(restored_bridge(model, bridge) for bridge in bridges), tuple(Interval(*interval) for interval in searched)
    )


def surveyed(model: Model, pose: Pose, trial: Pose) -> SingularityMap | None:
    """Return the singularity map with what a trial pose shows: the map itself if that is nothing new.

    New is a bridge, where the trial comes near a singular point, or a searched interval, where no bridge holds.
    """
    singularities: SingularityMap | None = trial.singularities
    here, known = trial.u[0], singularities or SingularityMap()
    low = [k for k, d in enumerate(trial.determinants) if -REGULAR < d < REGULAR and not known.knows(here, k)]
    if not low:
        return singularities
    if model.DRIVER_KINDS[0] == "angle":
        for old in known.bridges:
            again = moved(model, old, pose, here)
            if again is not None:
                return known.with_bridge(again, pose.u[0])
    reach: float = model.REACH[0]
    before: Pose | None = pose
    if abs(here - pose.u[0]) <= NEXT_TO * reach:
        rough = [secant_zero(pose, trial, block) for block in low]
        if all(zero is not None and abs(zero - here) > FAR_OFF * HALF_WIDTH * reach for zero in rough):
            return singularities
        before = _nearby(model, trial, low[0], 0.02 * reach)
    if before is None:
        return singularities
    for block in low:  # upstream first
        zero = secant_zero(before, trial, block)
        if zero is None or abs(zero - here) > 1.05 * HALF_WIDTH * reach or known.knows(zero, block):
            continue
        bridge = build(model, before, block, zero)
        if bridge is None:
            width = 2.0 * HALF_WIDTH * reach
            interval = Interval(zero - width, zero + width, block)
        elif known.knows(bridge.centre, block):
            interval = Interval(min(here, bridge.centre), max(here, bridge.centre), block)
        else:
            return known.with_bridge(bridge, pose.u[0])
        singularities = known = known.with_interval(interval, len(trial.determinants))
    return singularities


def _nearby(model: Model, pose: Pose, block: int, distance: float) -> Pose | None:
    """Return a pose at a distance from another, on the side where a block's determinant grows, if any."""
    for offset in (distance, -distance):
        other = follow_path(model, pose, pose.u[0] + offset)
        if other is not None and abs(other.determinants[block]) > abs(pose.determinants[block]):
            return other
    return None


def build(model: Model, pose: Pose, block: int, zero: float) -> Bridge | None:
    """Return a bridge over the zero of a block's determinant ahead of a regular pose, or None if none is accepted.

    zero: a first estimate. Windows shrink until they hold one point and its six nodes, and both widths agree. Then the
    closing decides: where lengths miss a change point, no narrower window would close. A dead centre gives no bridge:
    the determinant does not fall to zero straight, the far side cannot be reached.
    """
    reach: float = model.REACH[0]
    centre = _located(model, pose, block, zero)
    if centre is None:
        return None
    half, best, apart = HALF_WIDTH * reach, None, AGREED
    while half >= NARROWEST * reach and apart > FINE:
        span = _spanned(model, pose, block, centre, half)
        if span is not None and span.apart() < apart:
            best, apart = span, span.apart()
        half *= 0.5
    if best is None:
        return None
    bridge = Bridge(best)
    return bridge if bridge.closes() else None


def _located(model: Model, pose: Pose, block: int, zero: float) -> float | None:
    """Return where a block's determinant vanishes, by secants from the near side; None if it does not fall straight.

    Towards a dead centre it falls like a square root: the secant's zero is about twice as far as the dead centre.
    """
    reach: float = model.REACH[0]
    step = 0.5 * (zero - pose.u[0])
    is_compared = False  # the first step says nothing: the estimate may stem from the same two places
    while abs(step) > 0.1 * NARROWEST * reach:
        ahead = follow_path(model, pose, pose.u[0] + step)
        if ahead is None:
            step, is_compared = 0.5 * step, False
            continue
        better = secant_zero(pose, ahead, block)
        if better is None or (better - ahead.u[0]) * step <= 0.0:
            return None
        change = abs(better - zero)
        if is_compared and change <= STRAIGHT * abs(better - ahead.u[0]) and change <= 0.2 * NARROWEST * reach:
            return better
        pose, zero, is_compared = ahead, better, True
        step = 0.5 * (zero - pose.u[0])
    return None


def _spanned(model: Model, pose: Pose, block: int, centre: float, half: float) -> Span | None:
    """Return a span of one width over the zero of a block's determinant, built from the side of the pose, or None."""
    side = 1.0 if centre > pose.u[0] else -1.0
    near: list[Pose] = []
    for distance in (4.0, 2.0, 1.0):
        arrived = follow_path(model, near[-1] if near else pose, centre - side * distance * half)
        if arrived is None:
            return None
        near.append(arrived)
    far = _crossed(model, centre, half, side, near)
    if far is None:
        return None
    if near[-1].determinants[block] * far[0].determinants[block] >= 0.0 and block not in model.TALL:
        return None  # the determinant touches zero without crossing it: not a change point of two smooth branches
    return Span(model, centre, half, near + far if side > 0.0 else (near + far)[::-1])


def secant_zero(a: Pose, b: Pose, block: int) -> float | None:
    """Return the driver value where the determinant of a block vanishes on the secant through two poses."""
    rise = b.determinants[block] - a.determinants[block]
    return None if rise == 0.0 else b.u[0] - b.determinants[block] * (b.u[0] - a.u[0]) / rise


def _crossed(model: Model, centre: float, half: float, side: float, near: list[Pose]) -> list[Pose] | None:
    """Return poses at 1, 2, 4 half widths on the far side, each extrapolated from the last and corrected, or None."""
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
            return None  # there is another zero next to the one to be bridged
        if model.LAW_UNITS and passes_unseen(model, poses[-1], pose, UNIT_SPEED, u[0] - poses[-1].u[0]):
            return None
        places.append(distance)
        poses.append(pose)
    return poses[3:]
