from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of
from kinfmu.units import Radians


@dataclass(frozen=True)
class Fixed(Joint):
    """Two bodies welded together.

        Phi = [r_j + A_j s_b - r_i - A_i s_a; phi_j - phi_i - angle]        (3 rows, scales 1)

    Haug (1989).
    """

    type: ClassVar[str] = "fixed"
    labels: ClassVar[tuple[str, ...]] = ("x", "y", "angle")

    name: str
    between: Annotated[PointPair, "the two points 'body.point' that coincide"]
    angle: Annotated[Radians, "angle of body j relative to body i [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        i, j = self.bodies()
        return (*at.vector(self.between), AngleBetween(j, i).row(at, self.angle))

    def kinds(self) -> tuple[str, ...]:
        return "length", "length", "angle"
