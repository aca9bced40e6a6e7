from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.joints.cam import CamCurve
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of
from kinfmu.units import Radians


@dataclass(frozen=True)
class CamFlatFace(CamCurve):
    """A flat face on a cam: the face stays tangent to the cam's profile.

        Phi = m.d - f(angle of m in the cam's frame),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    m: normal of the face; f: support function of the profile, the distance of its tangent from the pole over the
    direction of the tangent's normal. A circle of radius R about a point at a distance e from the pole has
    f = R + e cos(angle). The profile has the radius of curvature f + f'', which must be positive.
    """

    type: ClassVar[str] = "cam_flat_face"
    labels: ClassVar[tuple[str, ...]] = ("distance",)
    distance: ClassVar[str] = "tangent's distance from the pole"
    curve: ClassVar[str] = "profile"

    name: str
    between: Annotated[PointPair, "the pole of the law on the cam i, then a point of the face on the follower j"]
    law: Annotated[
        Law,
        "distance f > 0 of the profile's tangent from the pole over the direction of its normal in the cam's frame "
        "[length over rad], period: a turn",
    ]
    normal: Annotated[Radians, "direction of the normal m of the face, away from the cam, in j's frame [rad]"] = 0.0

    def residual(self, at: Placement) -> tuple[Value, ...]:
        law, angle = self.led_by(at)
        (d_x, d_y), (m_x, m_y) = at.vector(self.between), at.direction(body_of(self.between[1]), self.normal)
        return (m_x * d_x + m_y * d_y - law.at(angle),)

    def led_by(self, at: Placement) -> tuple[Law, Value]:
        cam, follower = self.bodies()
        return self.law, at.angle(follower) + self.normal - at.angle(cam)
