"""The driver of a position along a slide."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import PositionAlong
from kinfmu.measures.placement import PointPair
from kinfmu.units import Quantity, Radians


@dataclass(frozen=True)
class SlideDriver(Driver):
    """A driven position along a slide: a linear actuator.

        Phi = e.d - u(t),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "slide"
    noun: ClassVar[str] = "position"
    quantity: ClassVar[Quantity] = Quantity("length")

    name: str
    between: Annotated[PointPair, "a point of the slide on body i, then the moved point of body j"]
    axis: Annotated[Radians, "direction e in i's frame [rad]"] = 0.0
    law: Annotated[Law, "u(t) [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> PositionAlong:
        return PositionAlong(self.between, self.axis)
