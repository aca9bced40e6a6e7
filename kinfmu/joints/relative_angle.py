from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyPair
from kinfmu.units import Radians


@dataclass(frozen=True)
class RelativeAngle(Held):
    """The angle of one body against another, held at a value: they turn together.

        Phi = phi_j - phi_i - value        (1 row)

    between: bodies i and j; value: [rad]. Haug (1989), relative constraints.
    """

    type: ClassVar[str] = "relative_angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    between: BodyPair
    value: Radians = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.between[1], self.between[0]), self.value
