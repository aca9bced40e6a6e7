"""The driver of a body's angle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from kinfmu.drivers.driver import Driver
from kinfmu.laws import ConstantSpeed, Law
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyName
from kinfmu.units import Quantity


@dataclass(frozen=True)
class AngleDriver(Driver):
    """The angle of a body, driven: a crank turned by a motor on the ground.

        Phi = phi_i - u(t)        (1 row)

    of: the body; law: u(t) [rad]. Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "angle"
    noun: ClassVar[str] = "angle"
    quantity: ClassVar[Quantity] = Quantity("angle")

    name: str
    of: BodyName
    law: Law = field(default_factory=ConstantSpeed)

    def measured(self) -> AngleBetween:
        return AngleBetween(self.of)
