"""A world coordinate of a point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.measures.arithmetic import Value
from kinfmu.measures.measure import Measure
from kinfmu.measures.placement import Axis, Placement, PointName, body_of


@dataclass(frozen=True)
class CoordinateOf(Measure):
    """World coordinate of a point."""

    type: ClassVar[str] = "coordinate"
    kind: ClassVar[str] = "length"
    is_absolute: ClassVar[bool] = True

    of: Annotated[PointName, "the point"]
    axis: Annotated[Axis, "'x' or 'y'"]

    def bodies(self) -> tuple[str, ...]:
        return (body_of(self.of),)

    def value(self, at: Placement) -> Value:
        x, y = at.point(self.of)
        return x if self.axis == "x" else y
