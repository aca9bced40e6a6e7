from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import CoordinateOf
from kinfmu.measures.decimal_sum import decimal_sum
from kinfmu.measures.placement import Axis, PointName
from kinfmu.units import Length


@dataclass(frozen=True)
class Coordinate(Held):
    """A fixed world coordinate of a point: the point slides along a line parallel to an axis.

        Phi = (r_i + A_i s_a)_x - value     or the same with y        (1 row, scale 1)

    Haug (1989), absolute constraints.
    """

    type: ClassVar[str] = "coordinate"
    labels: ClassVar[tuple[str, ...]] = ("value",)

    name: str
    of: Annotated[PointName, "the point 'body.point'"]
    axis: Annotated[Axis, "'x' or 'y'"]
    value: Annotated[Length, "the coordinate [length]"] = 0.0

    def moved(self, dx: float, dy: float) -> Coordinate:
        return replace(self, value=decimal_sum(self.value, dx if self.axis == "x" else dy))

    def measured(self) -> tuple[CoordinateOf, float]:
        return CoordinateOf(self.of, self.axis), self.value
