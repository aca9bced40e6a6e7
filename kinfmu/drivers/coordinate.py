"""The driver of a point's coordinate."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import CoordinateOf
from kinfmu.measures.placement import Axis, PointName
from kinfmu.units import Quantity


@dataclass(frozen=True)
class CoordinateDriver(Driver):
    """A driven world coordinate of a point.

        Phi = (r_i + A_i s_a)_x - u(t)     or the same with y        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "coordinate"
    noun: ClassVar[str] = "position"
    quantity: ClassVar[Quantity] = Quantity("length")

    name: str
    of: Annotated[PointName, "the point"]
    axis: Annotated[Axis, "'x' or 'y'"]
    law: Annotated[Law, "u(t) [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> CoordinateOf:
        return CoordinateOf(self.of, self.axis)
