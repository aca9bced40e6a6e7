"""The distance of two points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.measures.arithmetic import Value, sqrt
from kinfmu.measures.measure import Measure
from kinfmu.measures.placement import Placement, PointPair, body_of


@dataclass(frozen=True)
class DistanceBetween(Measure):
    """Distance L = |d| of two points.

    The row d.d - L^2 needs no root and is smooth for every d.
    """

    type: ClassVar[str] = "distance"
    kind: ClassVar[str] = "length"

    between: Annotated[PointPair, "the two points"]

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def value(self, at: Placement) -> Value:
        return sqrt(self._squared(at))

    def row(self, at: Placement, target: Value) -> Value:
        return self._squared(at) - target * target

    def scale(self, target: float) -> float:
        return 2.0 * target

    def gap(self, residual: float, target: float) -> float:
        return math.sqrt(max(residual + target * target, 0.0)) - target

    def _squared(self, at: Placement) -> Value:
        (a_x, a_y), (b_x, b_y) = map(at.point, self.between)
        d_x, d_y = b_x - a_x, b_y - a_y
        return d_x * d_x + d_y * d_y
