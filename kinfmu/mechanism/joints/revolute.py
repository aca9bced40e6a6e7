from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of


@dataclass(frozen=True)
class Revolute(Joint):
    """A pin: one point of each body, in the same place.

        Phi = r_j + A_j s_b - r_i - A_i s_a        (2 rows, scale 1)

    Haug (1989), revolute joint.
    """

    type: ClassVar[str] = "revolute"
    labels: ClassVar[tuple[str, ...]] = ("x", "y")

    name: str
    between: Annotated[PointPair, "the two points 'body.point', s_a and s_b in their bodies' frames"]

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        return at.vector(self.between)
