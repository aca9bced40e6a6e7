"""Where a point lies against an axis of another body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.measures.arithmetic import Value
from kinfmu.measures.measure import Measure
from kinfmu.measures.placement import Placement, PointPair, body_of
from kinfmu.units import Radians


@dataclass(frozen=True)
class PositionAlong(Measure):
    """Position of a point along an axis through another: e.d with d = r_b - r_a and e fixed in a's body."""

    type: ClassVar[str] = "position"
    kind: ClassVar[str] = "length"

    between: Annotated[PointPair, "the points a and b"]
    axis: Annotated[Radians, "angle of e in a's body's frame [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def value(self, at: Placement) -> Value:
        (a_x, a_y), (b_x, b_y) = map(at.point, self.between)
        e_x, e_y = at.direction(body_of(self.between[0]), self.axis)
        return e_x * (b_x - a_x) + e_y * (b_y - a_y)


@dataclass(frozen=True)
class OffsetFrom(Measure):
    """Distance of a point to the left of an axis through another: n.d with n = e turned by 90 degrees."""

    type: ClassVar[str] = "offset"
    kind: ClassVar[str] = "length"

    between: Annotated[PointPair, "the points a and b"]
    axis: Annotated[Radians, "angle of e in a's body's frame [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def value(self, at: Placement) -> Value:
        (a_x, a_y), (b_x, b_y) = map(at.point, self.between)
        e_x, e_y = at.direction(body_of(self.between[0]), self.axis)
        return e_x * (b_y - a_y) - e_y * (b_x - a_x)
