from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.cam import Cam
from kinfmu.laws import Law
from kinfmu.measures import PositionAlong
from kinfmu.measures.placement import BodyName, PointPair, body_of
from kinfmu.units import Length, Radians


@dataclass(frozen=True)
class CamTranslating(Cam):
    """A cam that lifts a follower along an axis by a lift law.

        Phi = e.d - offset - f(phi_k - phi_i),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    The guide is a separate joint. After Haug (1989), cam-followers, which are given there by profiles.
    """

    type: ClassVar[str] = "cam_translating"
    labels: ClassVar[tuple[str, ...]] = ("lift",)
    led: ClassVar[str] = "length"

    name: str
    between: Annotated[PointPair, "a point of body i, which holds cam and guide, then a point of the follower j"]
    cam: Annotated[BodyName, "the cam, body k"]
    law: Annotated[Law, "lift f over the cam's angle [length over rad]"]
    axis: Annotated[Radians, "direction e of the lift in i's frame [rad]"] = 0.0
    offset: Annotated[Length, "position of the follower where the lift is 0 [length]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return (*map(body_of, self.between), self.cam)

    def follower(self) -> PositionAlong:
        return PositionAlong(self.between, self.axis)
