"""The driver of a distance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import DistanceBetween
from kinfmu.measures.placement import PointPair
from kinfmu.units import Quantity


@dataclass(frozen=True)
class DistanceDriver(Driver):
    """A driven distance of two points: a cylinder between two bodies.

        Phi = d.d - u(t)^2,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "distance"
    noun: ClassVar[str] = "length"
    quantity: ClassVar[Quantity] = Quantity("length")

    name: str
    between: Annotated[PointPair, "the two points"]
    law: Annotated[Law, "u(t) > 0 [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> DistanceBetween:
        return DistanceBetween(self.between)
