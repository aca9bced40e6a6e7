from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.errors import MechanismError
from kinfmu.joints.arithmetic import Value
from kinfmu.joints.joint import Joint, Placement, PointPair, body_of
from kinfmu.units import Length

SHORTEST = 1e-30  # [length]; squares of anything shorter run out of digits


@dataclass(frozen=True)
class Distance(Joint):
    """Two points, one on each body, kept a fixed distance apart (revolute-revolute link).

        Phi = d.d - L^2,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 2 L)

    between: the two points 'body.point'; length: L > 0, in the mechanism's unit of length. Haug (1989), planar
    composite joints.
    """

    type: ClassVar[str] = "distance"
    labels: ClassVar[tuple[str, ...]] = ("length",)

    name: str
    between: PointPair
    length: Length

    def __post_init__(self) -> None:
        if not self.length >= SHORTEST:  # NaN too
            raise MechanismError(
                f"[joints.{self.name}] length = {self.length!r} must be a positive number, {SHORTEST:g} or more",
                joint=self.name,
            )

    def bodies(self) -> tuple[str, ...]:
        return tuple(body_of(point) for point in self.between)

    def residual(self, at: Placement) -> tuple[Value, ...]:
        a_x, a_y = at.point(self.between[0])
        b_x, b_y = at.point(self.between[1])
        d_x, d_y = b_x - a_x, b_y - a_y
        return (d_x * d_x + d_y * d_y - self.length * self.length,)

    def scales(self) -> tuple[float, ...]:
        return (2.0 * self.length,)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        return (math.sqrt(max(residual[0] + self.length * self.length, 0.0)) - self.length,)
