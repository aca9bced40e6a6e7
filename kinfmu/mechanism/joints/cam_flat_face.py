from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.cam import closing
from kinfmu.mechanism.joints.joint import Condition, Joint
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.laws.law import TURN, values_by_degree
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement, PointPair, body_of
from kinfmu.units import Radians

_SAMPLES = 360  # angles at which the distance is sampled, one per degree


@dataclass(frozen=True)
class CamFlatFace(Joint):
    """A flat face on a cam: the face stays tangent to the cam's profile.

        Phi = m.d - f(angle of m in the cam's frame),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    m: normal of the face; f: support function of the profile, the distance of its tangent from the pole over the
    direction of the tangent's normal. A circle of radius R about a point at a distance e from the pole has
    f = R + e cos(angle). The profile has the radius of curvature f + f'', which must be positive.
    """

    type: ClassVar[str] = "cam_flat_face"
    labels: ClassVar[tuple[str, ...]] = ("distance",)

    name: str
    between: Annotated[PointPair, "the pole of the law on the cam i, then a point of the face on the follower j"]
    law: Annotated[
        Law,
        "distance f > 0 of the profile's tangent from the pole over the direction of its normal in the cam's frame "
        "[length over rad], period: a turn",
    ]
    normal: Annotated[Radians, "direction of the normal m of the face, away from the cam, in j's frame [rad]"] = 0.0

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return "length", "angle"

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def residual(self, at: Placement) -> tuple[Value, ...]:
        law, angle = self.led_by(at)
        (d_x, d_y), (m_x, m_y) = at.vector(self.between), at.direction(body_of(self.between[1]), self.normal)
        return (m_x * d_x + m_y * d_y - law.at(angle),)

    def led_by(self, at: Placement) -> tuple[Law, Value]:
        cam, follower = self.bodies()
        return self.law, at.angle(follower) + self.normal - at.angle(cam)

    def reach(self) -> float:
        return max(float(self.law.at(k * TURN / _SAMPLES)) for k in range(_SAMPLES))

    def conditions(self) -> tuple[Condition, ...]:
        return closing(self.law)

    def check(self) -> None:
        where = f"[joints.{self.name}]"
        self.law.check(where)
        why = self.law.why_not_periodic()
        if why:
            raise MechanismError(f"{where} law: {why}; a profile must close", joint=self.name)
        for degrees, distance in enumerate(values_by_degree(self.law)):
            if not distance > 0.0:
                raise MechanismError(
                    f"{where} law: the tangent's distance from the pole is {distance:.6g} at {degrees} deg; "
                    "it must be positive",
                    joint=self.name,
                )
