"""The driver of an angle between bodies."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyPair
from kinfmu.units import Quantity


@dataclass(frozen=True)
class RelativeAngleDriver(Driver):
    """A driven angle of one body relative to another: a motor in a joint between moving bodies.

        Phi = phi_j - phi_i - u(t)        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "relative_angle"
    noun: ClassVar[str] = "angle"
    quantity: ClassVar[Quantity] = Quantity("angle")

    name: str
    between: Annotated[BodyPair, "bodies i and j"]
    law: Annotated[Law, "u(t) [rad]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> AngleBetween:
        return AngleBetween(self.between[1], self.between[0])
