from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.quantities import AngleBetween, OffsetFrom
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of
from kinfmu.units import Radians


@dataclass(frozen=True)
class Translational(Joint):
    """A slide (prismatic joint): body j moves along a line fixed in body i and does not turn relative to it.

        Phi = [n.d; phi_j - phi_i - angle],   d = r_j + A_j s_b - r_i - A_i s_a        (2 rows, scales 1)

    Haug (1989), translational joint.
    """

    type: ClassVar[str] = "translational"
    labels: ClassVar[tuple[str, ...]] = ("across", "angle")

    name: str
    between: Annotated[PointPair, "a point of the line on body i, then the point of body j that stays on it"]
    axis: Annotated[Radians, "direction of the line in i's frame [rad]"] = 0.0
    angle: Annotated[Radians, "angle of j relative to i [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        i, j = self.bodies()
        return OffsetFrom(self.between, self.axis).row(at, 0.0), AngleBetween(j, i).row(at, self.angle)

    def kinds(self) -> tuple[str, ...]:
        return "length", "angle"
