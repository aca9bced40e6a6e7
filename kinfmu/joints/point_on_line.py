from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import OffsetFrom
from kinfmu.measures.placement import PointPair
from kinfmu.units import Radians


@dataclass(frozen=True)
class PointOnLine(Held):
    """A pin in a slot: a point of body j stays on a line fixed in body i (revolute-translational link of length 0).

        Phi = n.d,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    Haug (1989), planar composite joints.
    """

    type: ClassVar[str] = "point_on_line"
    labels: ClassVar[tuple[str, ...]] = ("across",)

    name: str
    between: Annotated[PointPair, "a point of the line on body i, then the pin on body j"]
    axis: Annotated[Radians, "direction of the line in i's frame [rad]; n is that direction turned by 90 degrees"] = 0.0

    def measured(self) -> tuple[OffsetFrom, float]:
        return OffsetFrom(self.between, self.axis), 0.0
