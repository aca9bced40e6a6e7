"""Road: what is known of the singular points on the way of a single driver."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

from .bridge import Bridge, restored
from .pose import Model

_KEPT = 32  # of each kind, the latest; what is met again after a turn should still be known


class Searched(NamedTuple):
    """A stretch where no zero of a block's determinant is to be sought (again): it is bridged beyond, or is none."""

    low: float
    high: float
    block: int


class Road(NamedTuple):
    """Bridges and searched stretches, the latest last, and the stretch [low, high] around a pose that has no window.

    A value: it travels with the poses that were found along it.
    """

    bridges: tuple[Bridge, ...] = ()
    searched: tuple[Searched, ...] = ()
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
        return Road(self.bridges, self.searched, low, high)

    def with_bridge(self, bridge: Bridge, u: float) -> Road:
        """The road with one more bridge, seen from a driver value; one of the same span makes way for it."""
        others = [known for known in self.bridges if known.span is not bridge.span]
        return Road((*others, bridge)[-_KEPT:], self.searched).around(u)

    def with_searched(self, stretch: Searched, blocks: int) -> Road:
        """The road with one more searched stretch; of one place there may be as many as the model has blocks."""
        return self._replace(searched=(*self.searched, stretch)[-_KEPT - blocks :])

    def knows(self, u: float, block: int) -> bool:
        """True if a block's zero near a driver value need not be sought.

        Between the outermost nodes of a bridge there is no other than those it spans.
        """
        for bridge in self.bridges:
            if bridge.nodes[0].u[0] <= u <= bridge.nodes[-1].u[0]:
                return True
        for stretch in self.searched:  # noqa: SIM110
            if stretch.block == block and stretch.low <= u <= stretch.high:
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
        return [[bridge.dump() for bridge in self.bridges], [list(stretch) for stretch in self.searched]]


def laid(model: Model, data: list[Any]) -> Road:
    """The road that was dumped."""
    bridges, searched = data
    return Road(tuple(restored(model, bridge) for bridge in bridges), tuple(Searched(*stretch) for stretch in searched))
