"""The driver of a body's angle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyName
from kinfmu.units import Quantity


@dataclass(frozen=True)
class AngleDriver(Driver):
    """A driven angle of a body: a crank turned by a motor on the ground.

        Phi = phi_i - u(t)        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "angle"
    noun: ClassVar[str] = "angle"
    quantity: ClassVar[Quantity] = Quantity("angle")

    name: str
    of: Annotated[BodyName, "the body"]
    law: Annotated[Law, "u(t) [rad]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> AngleBetween:
        return AngleBetween(self.of)
