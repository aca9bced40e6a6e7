from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from kinfmu.joints.arithmetic import Value
from kinfmu.joints.joint import Axis, Joint, Placement, PointName, body_of
from kinfmu.units import Length


@dataclass(frozen=True)
class Coordinate(Joint):
    """A world coordinate of a point, held at a value: the point slides along a line parallel to an axis.

        Phi = (r_i + A_i s_a)_x - value     or the same with y        (1 row, scale 1)

    of: the point 'body.point'; axis: 'x' or 'y'; value: in the mechanism's unit of length. Haug (1989), absolute
    constraints.
    """

    type: ClassVar[str] = "coordinate"
    labels: ClassVar[tuple[str, ...]] = ("value",)

    name: str
    of: PointName
    axis: Axis
    value: Length = 0.0

    def bodies(self) -> tuple[str, ...]:
        return (body_of(self.of),)

    def moved(self, dx: float, dy: float) -> Coordinate:
        return replace(self, value=self.value + (dx if self.axis == "x" else dy))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        x, y = at.point(self.of)
        return ((x if self.axis == "x" else y) - self.value,)
