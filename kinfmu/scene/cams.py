"""Cams: the profile, the pitch curve on which the roller's centre goes, and the roller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.joints import CamOscillating, CamRoller, CamTranslating
from kinfmu.joints.cam import Cam
from kinfmu.joints.joint import Joint
from kinfmu.measures.placement import body_of, unit_vector
from kinfmu.run import FloatArray
from kinfmu.scene.instant import Instant
from kinfmu.scene.placing import seen_from

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)[:-1]  # [rad], points of a pitch curve
_ROLLER = 0.25  # of the smallest radius of the pitch curve: files do not state the roller's radius
_BEND = 0.5  # of the smallest radius of curvature; a larger roller would undercut the profile


@dataclass(frozen=True, eq=False)
class CamShape:
    """A cam and its roller in the world as drawn.

    joint, cam, follower: names of the joint and the two bodies; pitch: the pitch curve (k, 2); roller: its centre (2,);
    radius: of the roller [length].
    """

    joint: str
    cam: str
    follower: str
    pitch: FloatArray
    roller: FloatArray
    radius: float

    @property
    def profile(self) -> FloatArray:
        """The pitch curve moved inwards by the roller's radius, (k, 2)."""
        return self.pitch - self.radius * _outward(self.pitch)

    @property
    def contact(self) -> FloatArray:
        """Point of contact of roller and cam, (2,)."""
        nearest = int(np.argmin(np.hypot(*(self.pitch - self.roller).T)))
        return np.asarray(self.roller - self.radius * _outward(self.pitch)[nearest])


def cam_shapes(shown: Instant) -> list[CamShape]:
    """Return all cams whose pitch curve is known."""
    found = [_shape(shown, joint) for joint in shown.joints]
    return [shape for shape in found if shape is not None]


def _shape(shown: Instant, joint: Joint) -> CamShape | None:
    if isinstance(joint, CamRoller):
        return _rolled(shown, joint)
    if isinstance(joint, CamTranslating):
        return _lifted(shown, joint)
    return _swung(shown, joint) if isinstance(joint, CamOscillating) else None


def _rolled(shown: Instant, joint: CamRoller) -> CamShape:
    """Return a cam whose pitch curve is given in polar coordinates."""
    pole, roller = joint.between
    cam = body_of(pole)
    radii = np.array([float(joint.law.at(angle)) for angle in _ANGLES])
    curve = shown.body_points[pole] + radii[:, None] * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
    bodies = (cam, body_of(roller))
    return _closed(joint.name, bodies, shown.placed(cam, curve), shown.point(pole), shown.point(roller))


def _lifted(shown: Instant, joint: CamTranslating) -> CamShape:
    """Return a cam that lifts a point of the follower along an axis."""
    a, b = joint.between
    holder = shown.poses[body_of(a)][:1]
    e = np.array(unit_vector(joint.axis))
    at = seen_from(holder, shown.point(b)[None])[0]
    foot = at - ((at - shown.body_points[a]) @ e) * e  # origin of the lift
    lifts = np.array([joint.offset + float(joint.law.at(angle)) for angle in _ANGLES])
    return _traced(shown, joint, body_of(b), shown.placed(joint.holder(), foot + lifts[:, None] * e), shown.point(b))


def _swung(shown: Instant, joint: CamOscillating) -> CamShape | None:
    """Return a cam that swings the point of the follower furthest from its pivot; None without such a point."""
    holder, follower = joint.between
    pivot = shown.axle(follower, holder)
    points = [shown.point(name) for name in shown.body_points if body_of(name) == follower]
    if pivot is None or not points:
        return None
    tip = max(points, key=lambda point: float(np.hypot(*(point - pivot))))
    swing = shown.angle(follower) - shown.angle(holder)
    angles = np.array([joint.offset + float(joint.law.at(angle)) for angle in _ANGLES]) - swing
    return _traced(shown, joint, follower, pivot + _turned(np.tile(tip - pivot, (len(angles), 1)), angles), tip)


def _traced(shown: Instant, joint: Cam, follower: str, tips: FloatArray, now: FloatArray) -> CamShape:
    """Return the cam that leads a follower's point through `tips` (k, 2) of the world at _ANGLES, the holder fixed."""
    axle = shown.axle(joint.cam, joint.holder())
    centre = shown.poses[joint.cam][0, :2] if axle is None else axle
    turn = shown.angle(joint.cam) - shown.angle(joint.holder())
    pitch = centre + _turned(tips - centre, turn - _ANGLES)
    return _closed(joint.name, (joint.cam, follower), pitch, centre, now)


def _closed(name: str, bodies: tuple[str, str], pitch: FloatArray, centre: FloatArray, roller: FloatArray) -> CamShape:
    """Return a cam with a roller that is small compared with the cam and its curvature; bodies: of cam and roller."""
    smallest = float(np.hypot(*(pitch - centre).T).min())
    return CamShape(name, *bodies, pitch, roller, min(_ROLLER * smallest, _BEND * _sharpest(pitch)))


def _turned(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Return vectors (k, 2), each turned by its angle [rad]."""
    c, s = np.cos(angles), np.sin(angles)
    return np.column_stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]])


def _outward(curve: FloatArray) -> FloatArray:
    """Return the outward unit normals (k, 2) of a closed curve."""
    along = np.roll(curve, -1, axis=0) - np.roll(curve, 1, axis=0)
    normal = np.column_stack([along[:, 1], -along[:, 0]]) * _sense(curve)
    return np.asarray(normal / np.maximum(np.hypot(*normal.T), 1e-30)[:, None])


def _sharpest(curve: FloatArray) -> float:
    """Return the smallest radius of curvature [length] of the convex parts of a closed curve."""
    before, after = curve - np.roll(curve, 1, axis=0), np.roll(curve, -1, axis=0) - curve
    bends = 2.0 * _sense(curve) * (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    lengths = np.hypot(*before.T) * np.hypot(*after.T) * np.hypot(*(before + after).T)
    around = bends > 1e-12 * np.abs(bends).max()
    return float((lengths[around] / bends[around]).min())


def _sense(curve: FloatArray) -> float:
    """Return 1.0 if a closed curve (k, 2) is counter-clockwise, -1.0 if clockwise."""
    after = np.roll(curve, -1, axis=0)
    return float(np.sign((curve[:, 0] * after[:, 1] - curve[:, 1] * after[:, 0]).sum()))
