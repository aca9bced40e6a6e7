from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.joint import Held
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyName
from kinfmu.units import Radians


@dataclass(frozen=True)
class Angle(Held):
    """The angle of one body, held at a value: it moves without turning.

        Phi = phi_i - value        (1 row)

    of: the body; value: [rad]. Haug (1989), absolute constraints.
    """

    type: ClassVar[str] = "angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    of: BodyName
    value: Radians = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.of), self.value
