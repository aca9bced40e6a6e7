from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.joint import Joint
from kinfmu.measures import AngleBetween, OffsetFrom
from kinfmu.measures.arithmetic import Value
from kinfmu.measures.placement import Placement, PointPair, body_of
from kinfmu.units import Radians


@dataclass(frozen=True)
class Translational(Joint):
    """A slide (prismatic joint): body j moves along a line fixed in body i and does not turn against it.

        Phi = [n.d; phi_j - phi_i - angle],   d = r_j + A_j s_b - r_i - A_i s_a        (2 rows, scales 1)

    between: a point of the line on body i, then the point of body j that stays on it; axis: direction of the line in
    i's frame [rad]; angle: of j against i [rad]. Haug (1989), translational joint.
    """

    type: ClassVar[str] = "translational"
    labels: ClassVar[tuple[str, ...]] = ("across", "angle")

    name: str
    between: PointPair
    axis: Radians = 0.0
    angle: Radians = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(body_of(point) for point in self.between)

    def residual(self, at: Placement) -> tuple[Value, ...]:
        i, j = self.bodies()
        return (
            OffsetFrom(self.between, self.axis).row(at, 0.0),
            AngleBetween(j, i).row(at, self.angle),
        )

    def kinds(self) -> tuple[str, ...]:
        return "length", "angle"
