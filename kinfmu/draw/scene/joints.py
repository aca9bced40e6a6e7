"""Shapes of joints: slides with the lines that a run uses, gears, belts and racks, cams with their followers."""

from __future__ import annotations

import cmath
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import strokes
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.placing import seen_from
from kinfmu.draw.scene.shape import Shape, points_of
from kinfmu.errors import MechanismError
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import CamFlatFace, CamRoller, Coordinate, Gear, PointOnLine, RackAndPinion, Translational
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.quantities.placement import body_of, unit_vector
from kinfmu.motion.cams import CAM_JOINTS, CamJoint, PlacedCam, placed_cam
from kinfmu.motion.cams.critical import cut_depths
from kinfmu.motion.cams.placed import members_of
from kinfmu.motion.cams.traced import ComplexArray, given_curve, pairs, traced

_BELT = 0.3  # of the distance of the axles: radius of a belt's larger pulley, since files state only the ratio
_BEYOND = 0.35  # of the pinion's radius, additional length at both ends of a rack
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)[:-1]  # [rad], points of a curve
_ON_LINE = 1e-6  # of its points' distance; a point that is nearer is on the line
_TOUCH = 1e-9  # of the radius; deeper cuts are more than rounding
_OVERHANG = 0.15  # of the contact's range, by which a flat face is longer on either side


@dataclass(frozen=True, eq=False)
class Slide:
    """A line fixed in one body, the holder, and the point of another that stays on it.

    origin: a point of the line, 'body.point', or 'ground' if it has no name; point: the sliding point; along: unit
    vector (2,) in the holder's frame; ends: of its path over the run in that frame, (2, 2), without a run of the slot
    as points of the holder show it; turns: True for a pin, which can turn, False for a block.
    """

    name: str
    origin: str
    point: str
    along: FloatArray
    ends: FloatArray
    turns: bool

    @property
    def holder(self) -> str:
        """The body of the line."""
        return body_of(self.origin)

    @property
    def slider(self) -> str:
        """The body of the point."""
        return body_of(self.point)


def slides(shown: Instant) -> list[Slide]:
    """Return all lines on which points slide; a held coordinate is a line of the ground."""
    lines = []
    for joint in shown.joints:
        if isinstance(joint, Coordinate):
            across = 0 if joint.axis == "x" else 1
            track = shown.track(joint.of)
            ends = np.array([np.nanmin(track, axis=0), np.nanmax(track, axis=0)])
            ends[:, across] = joint.value
            lines.append(Slide(joint.name, GROUND_NAME, joint.of, np.eye(2)[1 - across], ends, turns=True))
        elif isinstance(joint, PointOnLine):
            a, b = joint.between
            lines.append(_slide(shown, joint, a, b, joint.axis))
        elif isinstance(joint, Translational):
            a, b, axis = *joint.between, joint.axis
            if _is_block(shown, body_of(a)) and not _is_block(shown, body_of(b)):  # the line is that of the rod
                a, b, axis = b, a, axis - joint.angle
            lines.append(_slide(shown, joint, a, b, axis))
    return lines


def rods(shown: Instant, sliding: Sequence[Slide]) -> dict[str, FloatArray]:
    """Return ends (r, 2, 2) of slots and rods by moving body, in its frame; each includes the origin of its line."""
    lines: dict[str, list[FloatArray]] = {}
    for slide in sliding:
        if slide.holder != GROUND_NAME:
            origin = np.array(shown.body_points[slide.origin])
            line = [origin, *slide.ends]
            order = np.argsort([float(point @ slide.along) for point in line])
            lines.setdefault(slide.holder, []).append(np.array([line[order[0]], line[order[-1]]]))
    return {body: np.array(ends) for body, ends in lines.items()}


def _slide(shown: Instant, joint: Joint, a: str, b: str, axis: float) -> Slide:
    """Return the slide of b along an axis [rad] through a, in the frame of a's body."""
    turns, e = isinstance(joint, PointOnLine), np.array(unit_vector(axis))
    origin = np.array(shown.body_points[a])
    distance = (seen_from(shown.poses[body_of(a)], shown.track(b)) - origin) @ e
    low, high = float(np.nanmin(distance)), float(np.nanmax(distance))
    if len(distance) == 1 and turns:
        low, high = _slot(shown, a, e, float(distance[0]))
    return Slide(joint.name, a, b, e, np.array([origin + low * e, origin + high * e]), turns)


def _slot(shown: Instant, a: str, e: FloatArray, at: float) -> tuple[float, float]:
    """Return from where to where a slot is drawn without a run, from a point a along e (2,); at: the place of its pin.

    It ends at a, and at the next point of its body beyond the pin. A pin that slides from a itself has all of its link.
    """
    body = next(one for one in shown.mechanism.bodies if one.name == body_of(a))
    away = points_of(body) - shown.body_points[a]
    near = _ON_LINE * (float(np.abs(away).max(initial=0.0)) + abs(at))
    on_line = [float(along) for along in away[np.abs(away @ [-e[1], e[0]]) <= near] @ e]
    if abs(at) > near:
        end = min((along for along in on_line if along / at > 1.0 + _ON_LINE), key=abs, default=at)
        return min(0.0, end), max(0.0, end)
    return (0.0, 0.0) if body.name == GROUND_NAME else (min(on_line), max(on_line))


def place(shown: Instant, slide: Slide) -> tuple[FloatArray, FloatArray]:
    """Return the place of the sliding point, and the unit vector of its line."""
    ends = shown.placed(slide.holder, np.array([[0.0, 0.0], slide.along]))
    return shown.point(slide.point), ends[1] - ends[0]


def _is_block(shown: Instant, body: str) -> bool:
    """Return True for a moving body without extent, all of whose points coincide."""
    found = next(one for one in shown.mechanism.bodies if one.name == body)
    return body != GROUND_NAME and not np.ptp(points_of(found), axis=0).any()


def racks_of(shown: Instant) -> set[str]:
    """Return the bodies that are drawn as racks."""
    joints = shown.joints
    return {body_of(joint.between[1]) for joint in joints if isinstance(joint, RackAndPinion)}


def wheels(shown: Instant, size: float) -> Iterator[Shape]:
    """Yield gears, pulleys, belts and racks, in the world as drawn, whose axles are pinned on their carrier.

    size: about that of details [length].
    """
    for joint in shown.joints:
        if isinstance(joint, Gear):
            yield from _pair(shown, joint)
        elif isinstance(joint, RackAndPinion):
            yield from _rack(shown, joint, size)


def _pair(shown: Instant, joint: Gear) -> Iterator[Shape]:
    """Yield two wheels with radii from the distance of their axles and their ratio."""
    a, b = (shown.axle(gear, joint.carrier) for gear in joint.between)
    if a is None or b is None or (distance := float(np.hypot(*(b - a)))) == 0.0:
        return
    ratio = joint.ratio
    is_belt = ratio == 1.0 or (ratio > 0.0 and GROUND_NAME not in joint.between)
    if is_belt:
        larger = _BELT * distance
        radii = (larger, larger / ratio) if ratio >= 1.0 else (larger * ratio, larger)
    else:
        second = distance / abs(1.0 - ratio)
        radii = (abs(ratio) * second, second)
    for body, centre, radius in zip(joint.between, (a, b), radii, strict=True):
        yield from _wheel(shown, joint.name, body, centre, radius)
    if is_belt:
        for ends in _belt(a, b, radii):
            yield Shape("belt", joint.name, joint.carrier, ends)
    reach = radii[0] if ratio < 0.0 or is_belt or radii[0] > radii[1] else -radii[0]
    yield Shape("contact", joint.name, joint.carrier, (a + (b - a) / distance * reach)[None])


def _belt(a: FloatArray, b: FloatArray, radii: tuple[float, float]) -> FloatArray:
    """Return the ends (2, 2, 2) of the straight parts of an open belt around two pulleys at a and b."""
    d = b - a
    lean = np.arccos((radii[0] - radii[1]) / np.hypot(*d))  # from the line of axles to the radius where the belt leaves
    angles = np.arctan2(d[1], d[0]) + lean * np.array([1.0, -1.0])
    off = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.stack([a + radii[0] * off, b + radii[1] * off], axis=1)


def _rack(shown: Instant, joint: RackAndPinion, size: float) -> Iterator[Shape]:
    """Yield the rack over its path in the run, and the pinion."""
    holder, rack = map(body_of, joint.between)
    centre = shown.axle(joint.pinion, holder)
    if centre is None:
        return
    e = np.array(unit_vector(joint.axis))
    base = shown.placed(holder, np.array([[0.0, 0.0], e]))
    along = base[1] - base[0]
    across = np.array([-along[1], along[0]]) * (-1.0 if joint.radius > 0.0 else 1.0)
    radius = abs(joint.radius)
    contact = centre + radius * across
    way = seen_from(shown.poses[holder], shown.track(joint.between[1])) @ e
    way = way - way[0]
    end = _BEYOND * radius
    first, last = -np.nanmax(way) - end, -np.nanmin(way) + end  # part that passes the pinion, relative to the rack now
    ends = np.array([contact + first * along, contact + last * along])
    teeth = strokes.rack(last - first, size)
    yield Shape("rack", joint.name, rack, ends, shown.colour(rack), direction=across, strips=teeth)
    yield from _wheel(shown, joint.name, joint.pinion, centre, radius)
    yield Shape("contact", joint.name, rack, contact[None])


def _wheel(shown: Instant, joint: str, body: str, centre: FloatArray, radius: float) -> Iterator[Shape]:
    angle, colour = shown.angle(body), shown.colour(body)
    end = centre + radius * np.array([np.cos(angle), np.sin(angle)])
    yield Shape("wheel", joint, body, centre[None], colour, radius=radius)
    yield Shape("spoke", joint, body, np.array([centre, end]), colour)


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
    shapes = (_shape(shown, joint) for joint in shown.joints if isinstance(joint, CAM_JOINTS))
    return [shape for shape in shapes if shape is not None]


def _shape(shown: Instant, joint: CamJoint) -> CamShape | None:
    cam, follower, touching = members_of(joint)
    if isinstance(joint, CamRoller | CamFlatFace):
        (around, is_real), now = _given_turn(joint), _given(joint, np.array([_argument(shown, joint)]))
        origin = complex(*shown.body_points[joint.between[0]])
    else:
        try:
            placed = placed_cam(shown.mechanism, joint, {name: tuple(row[0]) for name, row in shown.poses.items()})
            around, now = _led(placed, _ANGLES), _led(placed, np.array([placed.turn]))
            is_real = _is_real(joint, around)
        except MechanismError:
            return None  # such as a law that does not repeat, or a follower without a guide
        origin = placed.axle
    if touching is None:
        return None
    normal, radius = getattr(joint, "normal", None), getattr(joint, "roller_radius", None)
    size = float(radius or 0.0) if is_real else 0.0
    profile, contact = around.curve - size * around.normal, now.curve - size * now.normal
    reach = face = None
    if normal is not None:
        reach = _reach(shown, joint, touching, normal, around)
        face = _face(shown, touching, normal, reach, float(np.abs(around.curve).max()))

    def drawn(points: ComplexArray) -> FloatArray:
        """Return the place in the world of points from the origin in the cam's frame."""
        return shown.placed(cam, pairs(points + origin))

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


def _led(placed: PlacedCam, s: FloatArray) -> _Curve:
    found = traced(placed, s)
    return _Curve(found.curve, found.normal, found.curve_radius, found.offset)


def _is_real(joint: CamJoint, around: _Curve) -> bool:
    """Return whether the follower touches a cam that can be made."""
    normal, radius = getattr(joint, "normal", None), getattr(joint, "roller_radius", None)
    if normal is not None:
        return bool((around.radius > 0.0).all() and ((around.curve * around.normal.conj()).real > 0.0).all())
    if radius is None:
        return False
    bends_less = (around.radius > radius) | (around.radius <= 0.0)
    if not (bends_less.all() and np.abs(around.curve).min() > radius):
        return False
    depths = cut_depths(
        around.curve, around.curve - radius * around.normal, radius
    )  # at a place by the roller at another
    return not depths.max() > _TOUCH * radius


@lru_cache(maxsize=64)
def _given_turn(joint: CamRoller | CamFlatFace) -> tuple[_Curve, bool]:
    """Return a given curve over a turn, and whether it can be made; states of a drawing share them."""
    around = _given(joint, _ANGLES)
    return around, _is_real(joint, around)


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
