"""Cams: a law gives the lift of a follower over the cam's angle, or a curve of the cam on which the follower stays."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.joints.joint import Condition, Joint
from kinfmu.mechanism.laws import Law, MotionSequence
from kinfmu.mechanism.laws.law import NEARLY, TURN, values_by_degree
from kinfmu.mechanism.quantities import AngleBetween, PoseQuantity, PositionAlong
from kinfmu.mechanism.quantities.arithmetic import Value, atan2, sqrt
from kinfmu.mechanism.quantities.placement import BodyName, BodyPair, Placement, PointPair, Reference, body_of
from kinfmu.units import Length, Quantity, Radians

RollerRadius = Annotated[
    float | None,
    Quantity("length"),
    "radius of the roller, 0 for a knife edge [length]; default: unknown, and then there is no profile",
]
FaceNormal = Annotated[
    float | None,
    Quantity("angle"),
    "direction of the normal of a flat face, away from the cam, in the follower's frame [rad]; default: no flat face",
]


def roller_conditions(radius: float | None) -> tuple[Condition, ...]:
    """Return the condition on the radius of a roller, none without one."""
    return () if radius is None else (Condition("roller_radius", radius, "0 or more"),)


def check_element(name: str, radius: float | None, normal: float | None = None) -> None:
    """Raise a MechanismError for a negative radius, or for both a roller and a flat face."""
    if radius is not None and not radius >= 0.0:
        raise MechanismError(f"[joints.{name}] roller_radius = {radius!r} must be 0 or more", joint=name)
    if radius is not None and normal is not None:
        raise MechanismError(
            f"[joints.{name}] has both 'roller_radius' and 'normal'; a follower has a roller or a flat face", joint=name
        )


_SAMPLES = 24  # angles in a turn at which the size of a lift is sampled
_SAMPLES_OF_CURVE = 360  # angles at which a distance is sampled, one per degree


class Cam(Joint):
    """A cam and follower: a quantity of the follower depends on the cam's angle relative to the body that holds both.

        Phi = quantity - offset - f(phi_k - phi_i)        (1 row, scale 1)

    A leaf defines the bodies and the quantity of the follower. A roller or a flat face of the follower determines the
    cam's profile, not the motion.
    """

    cam: str
    law: Law
    offset: float
    roller_radius: float | None
    normal: float | None
    led: ClassVar[str]  # 'length' or 'angle': what the lift is

    def holder(self) -> str:
        """Return body i, which holds the cam's axle and the follower's guide or pivot."""
        return self.bodies()[0]

    @abstractmethod
    def follower(self) -> PoseQuantity:
        """Return the quantity of the follower."""

    @abstractmethod
    def touching(self) -> str | None:
        """Return the follower's point that is the roller's centre, or is on the flat face; None if unknown."""

    @property
    def is_contact_known(self) -> bool:
        """True if a roller, a knife edge or a flat face is given; then the contact force has a known direction."""
        return self.touching() is not None and not (self.roller_radius is None and self.normal is None)

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.led, "angle"

    def residual(self, at: Placement) -> tuple[Value, ...]:
        law, turn = self.led_by(at)
        return (self.follower().value(at) - self.offset - law.at(turn),)

    def led_by(self, at: Placement) -> tuple[Law, Value]:
        return self.law, AngleBetween(self.cam, self.holder()).value(at)

    def kinds(self) -> tuple[str, ...]:
        return (self.led,)

    def reach(self) -> float:
        lifts = [abs(self.offset + self.law.at(k * TURN / _SAMPLES)) for k in range(_SAMPLES)]
        return max(lifts) if self.led == "length" else 0.0

    def conditions(self) -> tuple[Condition, ...]:
        return (*(closing(self.law) if self.law.repeats else ()), *roller_conditions(self.roller_radius))

    def check(self) -> None:
        where = f"[joints.{self.name}]"
        self.law.check(where)
        check_element(self.name, self.roller_radius, self.normal)
        if self.cam in self.bodies()[:2]:
            raise MechanismError(
                f"{where} cam = '{self.cam}' must be another body than the follower and what holds it", joint=self.name
            )
        why = _why_not_periodic(self.law, self.led) if self.law.repeats else ""
        if why:
            raise MechanismError(f"{where} law: {why}", joint=self.name)


def _why_not_periodic(law: Law, led: str) -> str:
    """Return why a law is not periodic, and what to change; '' if it is."""
    why = law.why_not_periodic()
    if not why:
        return ""
    if isinstance(law, MotionSequence):
        if abs(sum(segment.duration for segment in law.segments) - TURN) > NEARLY * TURN:
            return why
        if led == "angle":
            rises = [segment.rise for segment in law.segments if segment.rise != 0.0]
            why = f"the rises of its sequence add up to {math.degrees(sum(rises)):.9g} deg, not to 0"
            bare = next((rise for rise in rises if abs(rise) > TURN), None)
            if bare is not None:
                shown = listed(f"{math.degrees(rise):.6g} deg" for rise in rises)
                return f"{why} ({shown}); a bare angle is in radians: write '{bare:.6g} deg' for degrees"
    return f"{why}; a follower that goes on turn after turn needs a coupling"


def closing(law: Law) -> tuple[Condition, ...]:
    """Return the conditions for a law of an angle to be periodic over a turn."""
    return tuple(Condition(f"law: {key}", value, "0") for key, value in law.zeros().items())


@lru_cache(maxsize=64)
def _largest(law: Law) -> float:
    """Return the largest value of a law in a turn; mechanisms that differ in other numbers share it."""
    return max(float(law.at(k * TURN / _SAMPLES_OF_CURVE)) for k in range(_SAMPLES_OF_CURVE))


class CamCurve(Joint):
    """A follower on a curve that is fixed in the cam: a law gives its distance from a pole over a turn.

    Leaves define what the distance is, and where it is taken.
    """

    between: tuple[str, str]  # the pole on the cam, then a point of the follower
    law: Law
    distance: ClassVar[str]  # in messages
    curve: ClassVar[str]

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return "length", "angle"

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def reach(self) -> float:
        return _largest(self.law)

    def conditions(self) -> tuple[Condition, ...]:
        return closing(self.law)

    def check(self) -> None:
        where = f"[joints.{self.name}]"
        self.law.check(where)
        why = self.law.why_not_periodic()
        if why:
            raise MechanismError(f"{where} law: {why}; a {self.curve} must close", joint=self.name)
        for degrees, distance in enumerate(values_by_degree(self.law)):
            if not distance > 0.0:
                raise MechanismError(
                    f"{where} law: the {self.distance} is {distance:.6g} at {degrees} deg; it must be positive",
                    joint=self.name,
                )


@dataclass(frozen=True)
class CamTranslating(Cam):
    """A cam that lifts a follower along an axis by a lift law.

        Phi = e.d - offset - f(phi_k - phi_i),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    The guide is a separate joint. The point b is the centre of the roller, or a point of the flat face. After Haug
    (1989), cam-followers, which are given there by profiles.
    """

    type: ClassVar[str] = "cam_translating"
    labels: ClassVar[tuple[str, ...]] = ("lift",)
    led: ClassVar[str] = "length"

    name: str
    between: Annotated[PointPair, "a point of body i, which holds cam and guide, then a point of the follower j"]
    cam: Annotated[BodyName, "the cam, body k"]
    law: Annotated[
        Law,
        "lift f over the cam's angle [length over rad]; away from the cam it is positive if the axis points from the "
        "cam to the follower",
    ]
    axis: Annotated[Radians, "direction e of the lift in i's frame [rad]"] = 0.0
    offset: Annotated[Length, "position of the follower where the lift is 0 [length]"] = 0.0
    roller_radius: RollerRadius = None
    normal: FaceNormal = None

    def bodies(self) -> tuple[str, ...]:
        return (*map(body_of, self.between), self.cam)

    def touching(self) -> str:
        return self.between[1]

    def follower(self) -> PositionAlong:
        return PositionAlong(self.between, self.axis)


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
    law: Annotated[
        Law,
        "lift f over the cam's angle [rad over rad]; away from the cam it is positive if the cam is to the right, seen "
        "from the pivot towards the contact, else negative",
    ]
    offset: Annotated[Radians, "angle of the follower where the lift is 0 [rad]"] = 0.0
    contact: Annotated[
        str | None, Reference("point"), "centre of the roller, or a point of the flat face, on the follower"
    ] = None
    roller_radius: RollerRadius = None
    normal: FaceNormal = None

    def check(self) -> None:
        super().check()
        if self.contact is not None and body_of(self.contact) != self.between[1]:
            raise MechanismError(
                f"[joints.{self.name}] contact = '{self.contact}' must be a point of the follower '{self.between[1]}'",
                joint=self.name,
            )
        if self.contact is None and not (self.roller_radius is None and self.normal is None):
            raise MechanismError(
                f"[joints.{self.name}] needs the key 'contact': the centre of the roller, or a point of the flat face",
                joint=self.name,
            )

    def bodies(self) -> tuple[str, ...]:
        return (*self.between, self.cam)

    def touching(self) -> str | None:
        return self.contact

    def follower(self) -> AngleBetween:
        return AngleBetween(self.between[1], self.between[0])


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
