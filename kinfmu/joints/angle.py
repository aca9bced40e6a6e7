from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyName
from kinfmu.units import Radians


@dataclass(frozen=True)
class Angle(Held):
    """A fixed angle of one body: the body moves without turning.

        Phi = phi_i - value        (1 row)

    Haug (1989), absolute constraints.
    """

    type: ClassVar[str] = "angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    of: Annotated[BodyName, "the body"]
    value: Annotated[Radians, "the angle [rad]"] = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.of), self.value
