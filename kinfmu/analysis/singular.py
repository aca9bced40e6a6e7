"""Singular points on the way of a driver, and the range that it can reach."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kinfmu.analysis.way import Way
from kinfmu.equations.system import System
from kinfmu.plan import localized
from kinfmu.solver.python import Pose
from kinfmu.solver.python.bridge import Bridge
from kinfmu.solver.python.limit import NO_BLOCK, Limit


@dataclass(frozen=True)
class SingularPoint:
    """A driver value where a block's determinant vanishes.

    kind: 'change point' (branches cross, the motion goes on) or 'limit' (a dead centre: the motion turns back).
    block: its number, from 1, among the blocks of the plan in which the driver moves alone; 0 where none is to blame.
    """

    value: float
    kind: str
    block: int
    driver: str


@dataclass(frozen=True)
class LimitPosition:
    """The mechanism where a driver can go no further.

    value: of the driver [rad or length]; kind: 'dead centre' (the motion turns back), 'change point' (branches cross
    and no run goes over it) or 'end' (a distance of 0); coordinates: all of them by name, in the world; bodies: those
    that can move there while the drivers stand still.
    """

    value: float
    kind: str
    coordinates: Mapping[str, float] = field(hash=False)
    bodies: tuple[str, ...]


@dataclass(frozen=True)
class DriverRange:
    """How far a driver takes the mechanism, the other drivers at their start values, and what is singular on the way.

    driver, kind: its name, and 'angle' or 'length'; points: in the order of the driver value; lowest, highest: the
    limits, None where none was met; turns: after so many turns of an angle the mechanism is back where it was, None if
    it never was; reach: the values that were looked at [rad or length]; stopped: why it could not be followed further
    where that is no limit.
    """

    driver: str
    kind: str
    points: tuple[SingularPoint, ...]
    lowest: LimitPosition | None
    highest: LimitPosition | None
    turns: int | None
    reach: tuple[float, float]
    stopped: str | None = None

    @property
    def low(self) -> float | None:
        """Lower limit of the driver [rad or length], None where none was met."""
        return None if self.lowest is None else self.lowest.value

    @property
    def high(self) -> float | None:
        """Upper limit of the driver [rad or length], None where none was met."""
        return None if self.highest is None else self.highest.value


def driver_range(way: Way) -> DriverRange:
    """Singular points and limits met on a way."""
    limits = [limit for limit in (way.low, way.high) if limit is not None]
    found = [
        SingularPoint(
            limit.u[0],
            "change point" if _kind(limit) == "change point" else "limit",
            max(limit.block, -1) + 1,
            way.name,
        )
        for limit in limits
    ]
    found += [
        _change_point(way, bridge)
        for bridge in way.bridges
        if not any(bridge.low <= limit.u[0] <= bridge.high for limit in limits)  # a distance of 0 is no crossing
    ]
    found.sort(key=lambda point: point.value)
    return DriverRange(
        driver=way.name,
        kind=way.kind,
        points=tuple(found if way.kind != "angle" or limits else _distinct(found, way.turns or 1)),
        lowest=_position(way, way.low),
        highest=_position(way, way.high),
        turns=way.turns,
        reach=(way.poses[0].u[0], way.poses[-1].u[0]),
        stopped=way.stopped,
    )


def _position(way: Way, limit: Limit | None) -> LimitPosition | None:
    if limit is None:
        return None
    coordinates = way.at_limit(limit)
    return LimitPosition(limit.u[0], _kind(limit), coordinates, parting(way, coordinates))


def _kind(limit: Limit) -> str:
    """What a limit is, as LimitPosition has it."""
    if limit.block == NO_BLOCK:
        return "end"
    return "change point" if limit.crosses else "dead centre"


def _change_point(way: Way, bridge: Bridge) -> SingularPoint:
    """The zero of the determinant inside a bridge's window, by thirds: its size falls straight to it."""
    low, high = bridge.centre - 0.999 * bridge.half, bridge.centre + 0.999 * bridge.half
    block = _block(bridge)
    for _ in range(90):
        third = (high - low) / 3.0
        if _determinant(bridge, low + third, block) < _determinant(bridge, high - third, block):
            high -= third
        else:
            low += third
    return SingularPoint(0.5 * (low + high), "change point", block + 1, way.name)


def _block(bridge: Bridge) -> int:
    """The block that is interpolated; of several the one whose determinant is the smallest beside the point."""
    held = [block for block in range(len(bridge.nodes[2].determinants)) if bridge.span.held >> block & 1]
    return min(held, key=lambda block: abs(bridge.nodes[2].determinants[block]))


def _determinant(bridge: Bridge, u: float, block: int) -> float:
    """Its size."""
    pose: Pose = bridge.pose((u,))
    return abs(float(pose.determinants[block]))


def _distinct(points: Sequence[SingularPoint], turns: int) -> list[SingularPoint]:
    """Points that differ by whole periods are one, the one in [0, 2 pi turns); alike in every turn, by whole turns."""
    if turns > 1:
        once, all_turns = _distinct(points, 1), _modulo(points, turns)
        return once if len(all_turns) == turns * len(once) else all_turns
    return _modulo(points, turns)


def _modulo(points: Iterable[SingularPoint], turns: int) -> list[SingularPoint]:
    """Points brought to [0, 2 pi turns), each once, in order."""
    kept: dict[int, SingularPoint] = {}
    period = turns * math.tau
    for point in points:
        value = math.fmod(math.fmod(point.value, period) + period, period)
        value -= period if period - value < 1e-9 else 0.0
        kept.setdefault(round(value * 1e7), replace(point, value=value))
    return sorted(kept.values(), key=lambda point: point.value)


_MOVES = 1e-3  # of the largest motion; a body that moves less stands still
_MOST_COORDINATES = 600  # coordinates; the singular values of more take too long


def parting(way: Way, at_limit: dict[str, float]) -> tuple[str, ...]:
    """Names of the bodies that move in the null direction of Phi_q at a limit pose, in file order.

    at_limit: all coordinates by name. Empty for a mechanism too large to tell.
    """
    if len(at_limit) > _MOST_COORDINATES:
        return ()
    local, origin = localized(way.plan.mechanism)
    system = System(local)
    offset = {"x": origin.x, "y": origin.y, "phi": 0.0}
    q = np.array([at_limit[name] - offset[name.rpartition(".")[2]] for name in system.coordinates])
    free = np.linalg.svd(system.scaled_jacobian(q))[2][-1]  # (n,)
    moves = np.abs(free).reshape(-1, 3).max(axis=1)
    return tuple(
        body.name for body, most in zip(local.moving_bodies, moves, strict=True) if most > _MOVES * moves.max()
    )
