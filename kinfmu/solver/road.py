"""Road: what is known of the singular points on the way of a single driver."""

from __future__ import annotations

from typing import Any, NamedTuple

from .bridge import Bridge, restored
from .pose import Model, Pose

_KEPT = 4  # of each kind, the latest


class Blocked(NamedTuple):
    """A place that no bridge leads over: a dead centre, or branches that only come close."""

    low: float
    high: float


class Road(NamedTuple):
    """Bridges and blocked places, the latest last. A value: it travels with the poses that were found along it."""

    bridges: tuple[Bridge, ...] = ()
    blocked: tuple[Blocked, ...] = ()

    def with_bridge(self, bridge: Bridge) -> Road:
        return Road((*self.bridges, bridge)[-_KEPT:], self.blocked)

    def with_blocked(self, place: Blocked) -> Road:
        return Road(self.bridges, (*self.blocked, place)[-_KEPT:])

    def knows(self, u: float) -> bool:
        """True if the singular point near a driver value has been looked at."""
        return any(place.low <= u <= place.high for place in self.blocked) or any(
            abs(u - bridge.centre) <= 1.2 * bridge.half for bridge in self.bridges
        )

    def dump(self) -> list[Any]:
        """Plain numbers from which `laid` makes the same road."""
        return [[bridge.dump() for bridge in self.bridges], [list(place) for place in self.blocked]]


def laid(model: Model, data: list[Any]) -> Road:
    """The road that was dumped."""
    bridges, blocked = data
    return Road(tuple(restored(model, bridge) for bridge in bridges), tuple(Blocked(*place) for place in blocked))


def bridge_ahead(pose: Pose, target: float) -> Bridge | None:
    """The nearest known bridge between a pose and the target, or the one that the pose stands on."""
    if pose.bridge is not None:
        return pose.bridge  # type: ignore[no-any-return]  # declared Any, for bridges are made of poses
    here = pose.u[0]
    low, high = (here, target) if here < target else (target, here)
    nearest = None
    for bridge in pose.road.bridges:
        if low < bridge.high and bridge.low < high:  # their ways overlap; a node is at most on the edge of its own
            if nearest is None or abs(bridge.centre - here) < abs(nearest.centre - here):
                nearest = bridge
    return nearest
