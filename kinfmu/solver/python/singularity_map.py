"""Singularity map: the singular points known so far along one driver, and the bridges over them."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

from .bridge import Bridge, restored_bridge
from .pose import Model

_KEPT = 32  # of each kind, the latest; a full turn should find what the turn before it has found


class Interval(NamedTuple):
    """Driver values between which a block's determinant was searched for a zero: none is bridged there."""

    low: float
    high: float
    block: int


class SingularityMap(NamedTuple):
    """Bridges and searched intervals of one driver, the latest last.

    A value: each pose refers to the map that was known when it was found. Between `low` and `high`, which hold the
    driver value of that pose, there is no window of a bridge.
    """

    bridges: tuple[Bridge, ...] = ()
    searched: tuple[Interval, ...] = ()
    low: float = -inf
    high: float = inf

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
        return self._replace(searched=(*self.searched, interval)[-_KEPT - blocks :])

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
