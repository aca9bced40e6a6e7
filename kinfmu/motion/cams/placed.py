"""A cam in one pose of its mechanism: its axle, what touches it, and how its follower is guided."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

from kinfmu.errors import MechanismError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import CamFlatFace, CamOscillating, CamRoller, CamTranslating, Revolute, Translational
from kinfmu.mechanism.quantities.placement import BodyFrame, Placement, body_of, unit_vector

CamJoint = CamTranslating | CamOscillating | CamRoller | CamFlatFace
CAM_JOINTS = (CamTranslating, CamOscillating, CamRoller, CamFlatFace)
NO_PROFILE = "the cam has no closed profile"
_COAXIAL = 1e-12  # of the follower's arm: a pivot so close to the cam's axle is at it
_PARALLEL = 1e-9  # sine of the angle between the guide of a follower and the axis of its lift


@dataclass(frozen=True)
class PlacedCam:
    """A cam joint in one pose. Points and vectors are complex numbers x + i y, points from the cam's axle.

    joint: the joint; cam, follower, holder: bodies, the holder carries the cam's axle and the follower's guide;
    axle: of the cam in the cam's frame; pole: of a given curve, in the cam's frame;
    turn, swing: angles of cam and follower against the holder [rad]; quantity: what the law of a lift leads;
    point: the roller's centre or a point of the face, in the holder's frame; pivot: of a swinging follower, there too,
    None if it slides; direction: of the slide, a unit vector in the holder's frame;
    normal: of the flat face, a unit vector in the holder's frame, None for a roller; radius: of the roller, 0 for a
    knife edge, None if unknown.
    """

    joint: CamJoint
    cam: str
    follower: str
    holder: str
    axle: complex
    pole: complex
    turn: float
    swing: float
    quantity: float
    point: complex
    pivot: complex | None
    direction: complex
    normal: complex | None
    radius: float | None

    @property
    def is_known(self) -> bool:
        """True if the roller or the flat face is known, so that there is a profile."""
        return self.normal is not None or self.radius is not None


def placed_cam(mechanism: Mechanism, joint: CamJoint, poses: Mapping[str, tuple[float, float, float]]) -> PlacedCam:
    """Return the cam of a joint in one pose of its mechanism.

    poses: x, y [length] and phi [rad] by body, ground included; at least of cam, follower and holder. Raise a
    MechanismError if the law does not repeat after a turn, the cam has no axle, the follower no guide, or both turn
    about one axle; the message states which.
    """
    at = Placement({name: BodyFrame.of(*pose) for name, pose in poses.items()}, mechanism.body_points)
    where = f"cam '{joint.name}'"
    why = joint.law.why_not_periodic()
    if why:
        raise MechanismError(f"{where}: {NO_PROFILE}: {why}")
    cam, follower, touching = members_of(joint)
    if touching is None:
        raise MechanismError(
            f"{where}: [joints.{joint.name}] needs the key 'contact', the centre of the roller or a point of the face"
        )
    holder, guide = _guide(mechanism, joint, cam, follower)
    axle = next(one for one in mechanism.joints if isinstance(one, Revolute) and {*one.bodies()} == {cam, holder})

    def seen(body: str, vector: tuple[float, float]) -> complex:
        """Return a vector of the world as seen from a body."""
        return complex(*vector) * cmath.exp(-1j * float(at.angle(body)))

    centre = axle.between[0]
    own = axle.between[axle.bodies().index(cam)]
    pivot = seen(holder, at.vector((centre, guide.between[0]))) if isinstance(guide, Revolute) else None
    touched = seen(holder, at.vector((centre, touching)))
    if pivot is not None and isinstance(joint, CamRoller | CamFlatFace) and abs(pivot) <= _COAXIAL * abs(touched):
        raise MechanismError(
            f"{where}: {NO_PROFILE}: the follower '{follower}' is pinned at the cam's axle, '{guide.between[0]}', so "
            f"that it turns with the cam; pin it at another point of '{holder}'"
        )
    direction = 0j
    if isinstance(guide, Translational):
        direction = seen(holder, at.direction(guide.bodies()[0], guide.axis))
        if isinstance(joint, CamTranslating):
            direction = _lift_axis(joint, direction)
        elif (touched * direction.conjugate()).real < 0.0:
            direction = -direction  # outwards
    normal = getattr(joint, "normal", None)
    return PlacedCam(
        joint=joint,
        cam=cam,
        follower=follower,
        holder=holder,
        axle=complex(*mechanism.body_points[own]),
        pole=seen(cam, at.vector((own, joint.between[0]))) if isinstance(joint, CamRoller | CamFlatFace) else 0j,
        turn=float(at.angle(cam) - at.angle(holder)),
        swing=float(at.angle(follower) - at.angle(holder)),
        quantity=float(joint.follower().value(at)) if isinstance(joint, CamTranslating | CamOscillating) else 0.0,
        point=touched,
        pivot=pivot,
        direction=direction,
        normal=None if normal is None else seen(holder, at.direction(follower, normal)),
        radius=getattr(joint, "roller_radius", None),
    )


def members_of(joint: CamJoint) -> tuple[str, str, str | None]:
    """Return cam and follower, and the follower's point that is the roller's centre or on the face; None if unknown."""
    if isinstance(joint, CamTranslating | CamOscillating):
        return joint.cam, joint.bodies()[1], joint.touching()
    return body_of(joint.between[0]), body_of(joint.between[1]), joint.between[1]


def _guide(mechanism: Mechanism, joint: CamJoint, cam: str, follower: str) -> tuple[str, Revolute | Translational]:
    """Return the body to which the cam is pinned, and the pin or slide between it and the follower."""
    pinned = [
        next(body for body in one.bodies() if body != cam)
        for one in mechanism.joints
        if isinstance(one, Revolute) and cam in one.bodies()
    ]
    wanted = {CamTranslating: Translational, CamOscillating: Revolute}.get(type(joint), (Revolute, Translational))
    if isinstance(joint, CamTranslating | CamOscillating):
        pinned = [body for body in pinned if body == joint.holder()]
    for one in mechanism.joints:
        if isinstance(one, Revolute | Translational) and isinstance(one, wanted) and follower in one.bodies():
            holder = next(body for body in one.bodies() if body != follower)
            if holder in pinned:
                return holder, _from(holder, one)
    raise MechanismError(
        f"cam '{joint.name}': its profile needs a revolute joint between '{cam}' and the body that holds it, and a "
        f"revolute or translational joint between that body and the follower '{follower}'"
    )


def _from(holder: str, joint: Revolute | Translational) -> Revolute | Translational:
    """Return the guide; the first point of a pin is then the holder's."""
    if isinstance(joint, Revolute) and joint.bodies()[0] != holder:
        return Revolute(joint.name, joint.between[::-1])
    return joint


def _lift_axis(joint: CamTranslating, guide: complex) -> complex:
    """Return the direction of the lift in the holder's frame, which must be that of the guide."""
    axis = complex(*unit_vector(joint.axis))
    if abs((guide * axis.conjugate()).imag) > _PARALLEL:
        apart = math.degrees(math.asin(min(1.0, abs((guide * axis.conjugate()).imag))))
        raise MechanismError(
            f"cam '{joint.name}': the follower slides at {apart:.4g} deg to the axis of its lift; its profile needs "
            "both in one direction"
        )
    return axis
