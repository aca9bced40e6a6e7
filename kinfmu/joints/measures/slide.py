"""Where a point lies against an axis of another body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.arithmetic import Value
from kinfmu.joints.measures.measure import Measure
from kinfmu.joints.placement import Placement, body_of


@dataclass(frozen=True)
class PositionAlong(Measure):
    """How far point b lies along an axis through point a: e.d with d = r_b - r_a and e fixed in a's body.

    axis: angle of e in that body's frame [rad].
    """

    kind: ClassVar[str] = "length"

    a: str
    b: str
    axis: float = 0.0

    def bodies(self) -> tuple[str, ...]:
        return body_of(self.a), body_of(self.b)

    def value(self, at: Placement) -> Value:
        a_x, a_y = at.point(self.a)
        b_x, b_y = at.point(self.b)
        e_x, e_y = at.direction(body_of(self.a), self.axis)
        return e_x * (b_x - a_x) + e_y * (b_y - a_y)


@dataclass(frozen=True)
class OffsetFrom(Measure):
    """How far point b lies to the left of an axis through point a: n.d with n = e turned by 90 degrees."""

    kind: ClassVar[str] = "length"

    a: str
    b: str
    axis: float = 0.0

    def bodies(self) -> tuple[str, ...]:
        return body_of(self.a), body_of(self.b)

    def value(self, at: Placement) -> Value:
        a_x, a_y = at.point(self.a)
        b_x, b_y = at.point(self.b)
        e_x, e_y = at.direction(body_of(self.a), self.axis)
        return e_x * (b_y - a_y) - e_y * (b_x - a_x)
