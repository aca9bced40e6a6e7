from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyPair
from kinfmu.units import Radians


@dataclass(frozen=True)
class RelativeAngle(Held):
    """A fixed angle of one body relative to another: they turn together.

        Phi = phi_j - phi_i - value        (1 row)

    Haug (1989), relative constraints.
    """

    type: ClassVar[str] = "relative_angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    between: Annotated[BodyPair, "bodies i and j"]
    value: Annotated[Radians, "the angle [rad]"] = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.between[1], self.between[0]), self.value
