from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.cam import CamCurve, RollerRadius, check_element, roller_conditions
from kinfmu.mechanism.joints.joint import Condition
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.quantities.arithmetic import Value, atan2, sqrt
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of


@dataclass(frozen=True)
class CamRoller(CamCurve):
    """A roller on a cam: the roller's centre stays on the pitch curve.

        Phi = |d| - f(angle of d in the cam's frame),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    The pitch curve is the cam's profile moved outwards by the roller's radius. After Haug (1989), cam-followers.
    """

    type: ClassVar[str] = "cam_roller"
    labels: ClassVar[tuple[str, ...]] = ("radius",)
    distance: ClassVar[str] = "radius of the pitch curve"
    curve: ClassVar[str] = "pitch curve"

    name: str
    between: Annotated[
        PointPair,
        "the pole of the pitch curve on the cam i, then the roller's centre on the follower j",
    ]
    law: Annotated[
        Law,
        "radius of the pitch curve as a function of the polar angle in the cam's frame [length over rad]; positive, "
        "with a period of a turn",
    ]
    roller_radius: RollerRadius = None

    def residual(self, at: Placement) -> tuple[Value, ...]:
        law, angle = self.led_by(at)
        d_x, d_y = at.vector(self.between)
        return (sqrt(d_x * d_x + d_y * d_y) - law.at(angle),)

    def led_by(self, at: Placement) -> tuple[Law, Value]:
        d_x, d_y = at.vector(self.between)
        (e_x, e_y), (n_x, n_y) = (at.direction(body_of(self.between[0]), angle) for angle in (0.0, 0.5 * math.pi))
        return self.law, atan2(n_x * d_x + n_y * d_y, e_x * d_x + e_y * d_y)

    def conditions(self) -> tuple[Condition, ...]:
        return (*super().conditions(), *roller_conditions(self.roller_radius))

    def check(self) -> None:
        check_element(self.name, self.roller_radius)
        super().check()
