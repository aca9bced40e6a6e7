"""Road: what is known of the singular points on the way of a single driver."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

from .bridge import Bridge, restored
from .pose import Model

_KEPT = 8  # of each kind, the latest; what is met again after a turn should still be known


class Blocked(NamedTuple):
    """A place that no bridge leads over: a dead centre, or branches that only come close."""

    low: float
    high: float


class Road(NamedTuple):
    """Bridges and blocked places, the latest last, and the stretch [low, high] around a pose that is free of windows.

    surveyed: intervals where no further singular point is to be sought. A value: it travels with the poses that were
    found along it.
    """

    bridges: tuple[Bridge, ...] = ()
    blocked: tuple[Blocked, ...] = ()
    surveyed: tuple[tuple[float, float], ...] = ()
    low: float = -inf
    high: float = inf

    def around(self, u: float) -> Road:
        """The same road seen from a driver value: the stretch there, empty inside a window."""
        low, high = -inf, inf
        for bridge in self.bridges:
            if bridge.covers(u):
                low, high = inf, -inf
                break
            if bridge.centre < u:
                low = max(low, bridge.high)
            else:
                high = min(high, bridge.low)
        return Road(self.bridges, self.blocked, self.surveyed, low, high)

    def with_bridge(self, bridge: Bridge, u: float) -> Road:
        """The road with one more bridge, seen from a driver value; one of the same span makes way for it."""
        others = [known for known in self.bridges if known.span is not bridge.span]
        return _made((*others, bridge)[-_KEPT:], self.blocked).around(u)

    def with_blocked(self, place: Blocked, u: float) -> Road:
        """The road with one more blocked place, seen from a driver value."""
        return _made(self.bridges, (*self.blocked, place)[-_KEPT:]).around(u)

    def knows(self, u: float) -> bool:
        """True if the singular point near a driver value has been looked at."""
        for low, high in self.surveyed:  # noqa: SIM110
            if low <= u <= high:  # not any(...): a generator costs more than the two or three comparisons
                return True
        return False

    def next_bridge(self, here: float, target: float) -> Bridge:
        """The bridge whose window holds `here`, or the one that ends the stretch around it on the target's side."""
        for bridge in self.bridges:
            if bridge.covers(here):
                return bridge
        beyond = [bridge for bridge in self.bridges if (bridge.centre > here) == (target > here)]
        return min(beyond, key=lambda bridge: abs(bridge.centre - here))

    def dump(self) -> list[Any]:
        """Plain numbers from which `laid` makes the same road."""
        return [[bridge.dump() for bridge in self.bridges], [list(place) for place in self.blocked]]


def laid(model: Model, data: list[Any]) -> Road:
    """The road that was dumped."""
    bridges, blocked = data
    return _made(tuple(restored(model, bridge) for bridge in bridges), tuple(Blocked(*place) for place in blocked))


def _made(bridges: tuple[Bridge, ...], blocked: tuple[Blocked, ...]) -> Road:
    """Between a bridge's outermost nodes its own zero is the only one."""
    surveyed = [(place.low, place.high) for place in blocked]
    surveyed += [(bridge.nodes[0].u[0], bridge.nodes[-1].u[0]) for bridge in bridges]
    return Road(bridges, blocked, tuple(surveyed))
