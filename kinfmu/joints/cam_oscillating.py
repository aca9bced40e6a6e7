from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.cam import Cam
from kinfmu.laws import Law
from kinfmu.measures import AngleBetween
from kinfmu.measures.placement import BodyName, BodyPair
from kinfmu.units import Radians


@dataclass(frozen=True)
class CamOscillating(Cam):
    """A cam that swings a follower by a lift law.

        Phi = phi_j - phi_i - offset - f(phi_k - phi_i)        (1 row)

    After Haug (1989), cam-followers, which are given there by profiles.
    """

    type: ClassVar[str] = "cam_oscillating"
    labels: ClassVar[tuple[str, ...]] = ("lift",)
    led: ClassVar[str] = "angle"

    name: str
    between: Annotated[BodyPair, "body i, which holds both pivots, then the follower j"]
    cam: Annotated[BodyName, "the cam, body k"]
    law: Annotated[Law, "lift f over the cam's angle [rad over rad]"]
    offset: Annotated[Radians, "angle of the follower where the lift is 0 [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return (*self.between, self.cam)

    def follower(self) -> AngleBetween:
        return AngleBetween(self.between[1], self.between[0])
