"""Cams: the profile, the pitch curve on which the roller's centre goes, and the roller or the flat face."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.instant import Instant
from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints import CamFlatFace, CamRoller
from kinfmu.mechanism.quantities.placement import body_of, unit_vector
from kinfmu.motion.cams import CAM_JOINTS, CamJoint, PlacedCam, placed_cam
from kinfmu.motion.cams.critical import cut_depths
from kinfmu.motion.cams.placed import members_of
from kinfmu.motion.cams.traced import ComplexArray, given_curve, traced

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)[:-1]  # [rad], points of a curve
_TOUCH = 1e-9  # of the radius; deeper cuts are more than rounding
_OVERHANG = 0.15  # of the contact's range, by which a flat face is longer on either side


@dataclass(frozen=True, eq=False)
class CamShape:
    """A cam with its roller or flat face in the world as drawn.

    joint, cam, follower: names of the joint and the two bodies; profile: the real one (k, 2), None where the follower
    is unknown or would be undercut; pitch: the pitch curve (k, 2), None under a flat face; roller: its centre (2,);
    radius: of the roller [length], 0 where there is none; face: ends of the flat face (2, 2); away: unit vector (2,)
    from the cam through the face; contact: where both touch (2,), None without a profile; reach: the least and the
    largest distance of the contact from the follower's point along the face [length], counted along its line.
    """

    joint: str
    cam: str
    follower: str
    profile: FloatArray | None
    pitch: FloatArray | None
    roller: FloatArray
    radius: float
    face: FloatArray | None
    away: FloatArray | None
    contact: FloatArray | None
    reach: tuple[float, float] | None


class _Curve(NamedTuple):
    """Pitch curve or profile, outward normals and radii of curvature (n,), from an origin in the cam's frame."""

    curve: ComplexArray
    normal: ComplexArray
    radius: FloatArray
    offset: FloatArray


def cam_shapes(shown: Instant) -> list[CamShape]:
    """Return all cams whose pitch curve or profile is known."""
    found = [_shape(shown, joint) for joint in shown.joints if isinstance(joint, CAM_JOINTS)]
    return [shape for shape in found if shape is not None]


def _shape(shown: Instant, joint: CamJoint) -> CamShape | None:
    cam, follower, touching = members_of(joint)
    if isinstance(joint, CamRoller | CamFlatFace):
        around, now = _given(joint, _ANGLES), _given(joint, np.array([_argument(shown, joint)]))
        origin = complex(*shown.body_points[joint.between[0]])
    else:
        try:
            placed = placed_cam(shown.mechanism, joint, {name: tuple(row[0]) for name, row in shown.poses.items()})
            around, now = _led(placed, _ANGLES), _led(placed, np.array([placed.turn]))
        except MechanismError:
            return None  # such as a law that does not repeat, or a follower without a guide
        origin = placed.axle
    if touching is None:
        return None
    normal, radius = getattr(joint, "normal", None), getattr(joint, "roller_radius", None)
    is_real = normal is not None or radius is not None
    if normal is not None:
        is_real = bool((around.radius > 0.0).all() and ((around.curve * around.normal.conj()).real > 0.0).all())
    elif radius is not None:
        bends_less = (around.radius > radius) | (around.radius <= 0.0)
        is_real = bool(bends_less.all() and np.abs(around.curve).min() > radius) and not _cuts(around, radius)
    size = float(radius or 0.0) if is_real else 0.0
    profile, contact = around.curve - size * around.normal, now.curve - size * now.normal

    reach = face = None
    if normal is not None:
        reach = _reach(shown, joint, touching, normal, around)
        face = _face(shown, touching, normal, reach, float(np.abs(around.curve).max()))

    def drawn(points: ComplexArray) -> FloatArray:
        """Return the place in the world of points from the origin in the cam's frame."""
        return shown.placed(cam, np.column_stack([(points + origin).real, (points + origin).imag]))

    return CamShape(
        joint=joint.name,
        cam=cam,
        follower=follower,
        profile=drawn(profile) if is_real else None,
        pitch=drawn(around.curve) if normal is None else None,
        roller=shown.point(touching),
        radius=size,
        face=face,
        away=None if normal is None else np.array(unit_vector(shown.angle(follower) + normal)),
        contact=drawn(contact)[0] if is_real else None,
        reach=reach,
    )


def _cuts(around: _Curve, radius: float) -> bool:
    """Return True if the roller, at some place, cuts into the profile that it makes at another."""
    depths = cut_depths(around.curve, around.curve - radius * around.normal, radius)
    return bool(depths.max() > _TOUCH * radius)


def _led(placed: PlacedCam, s: FloatArray) -> _Curve:
    found = traced(placed, s)
    return _Curve(found.curve, found.normal, found.curve_radius, found.offset)


def _given(joint: CamRoller | CamFlatFace, s: FloatArray) -> _Curve:
    """Return a given curve; the contact on a face is then within the derivatives of the law, about the pole's foot."""
    curve, normal, radius = given_curve(joint, s)
    return _Curve(curve, normal, radius, (curve * (1j * normal).conj()).real)


def _argument(shown: Instant, joint: CamRoller | CamFlatFace) -> float:
    """Return the angle in the cam of the roller, or of the normal of the face, as drawn."""
    cam, follower = (shown.angle(body) for body in joint.bodies())
    if isinstance(joint, CamFlatFace):
        return follower + joint.normal - cam
    ends = [complex(*shown.point(point)) for point in joint.between]
    return cmath.phase(ends[1] - ends[0]) - cam


def _reach(shown: Instant, joint: CamJoint, touching: str, normal: float, around: _Curve) -> tuple[float, float]:
    """Return the range of the contact along a flat face in a turn, from the follower's point."""
    low, high = float(around.offset.min()), float(around.offset.max())
    if not isinstance(joint, CamFlatFace):
        return low, high
    along = _along(shown, touching, normal)  # its offsets are from the pole
    pole = ((complex(*shown.point(joint.between[0])) - complex(*shown.point(touching))) * along.conjugate()).real
    return low + pole, high + pole


def _face(shown: Instant, touching: str, normal: float, reach: tuple[float, float], size: float) -> FloatArray:
    """Return the ends of a flat face in the world: as far as the contact reaches, and a little more.

    The follower's point, which connects the face with its body, is on it.
    """
    along, place = _along(shown, touching, normal), complex(*shown.point(touching))
    more = _OVERHANG * max(reach[1] - reach[0], size)
    ends = [place + at * along for at in (min(reach[0] - more, 0.0), max(reach[1] + more, 0.0))]
    return np.array([[end.real, end.imag] for end in ends])


def _along(shown: Instant, touching: str, normal: float) -> complex:
    """Return the unit vector along a flat face."""
    return 1j * cmath.exp(1j * (shown.angle(body_of(touching)) + normal))
