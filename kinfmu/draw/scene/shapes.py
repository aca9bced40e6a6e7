"""All shapes of a mechanism: links, bars and cylinders, slides, cams, wheels, and the ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette, strokes
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.joints import Slide, cam_shapes, place, racks_of, rods, slides, wheels
from kinfmu.draw.scene.loads import BETWEEN, lengths_between, load_shapes
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.shape import Shape, bar_frame, cylinder_frames, die_frame, points_of, ribs, rim
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import DistanceDriver, Driver
from kinfmu.mechanism.joints import CamRoller, Distance, Fixed, PointOnLine, Revolute
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities.placement import body_of, point_of

_CROWDED = 0.8  # cosine of the angle to a link; above it a support would hide the link
_SIDES = ((0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 1.0))  # of a support; below is preferred
_BARREL, _OF_SHORTEST = 0.62, 0.9  # length of the barrel: of the usual length, and at most of the shortest one
_SMALLEST = 0.3  # of the usual length, smallest barrel if the shortest length is very small
_GUIDED, _FREE = 0.1, 0.12  # of the barrel: with the rod in the longest pose; without the piston
_POSES = 24  # of a run, that decide the size of details
_STEEP = 0.9  # sine of a rail's angle, above which the ground is on the side away from the mechanism


def shapes(shown: Instant) -> list[Shape]:
    """Return everything to draw of the bodies whose poses are known, but for pins, arrows and paths."""
    sliding = slides(shown)
    box = _box(shown)
    size = _detail(shown)
    in_world = [*_cams(shown), *wheels(shown, size), *_slides(shown, sliding, box, size), *_supports(shown)]
    acting = load_shapes(shown, box)
    return [*_links(shown, sliding), *_between(shown), *(_in_frame(shown, shape) for shape in in_world), *acting]


def _in_frame(shown: Instant, shape: Shape) -> Shape:
    """Return a shape of the world as drawn, fixed in its frame."""
    points = shown.seen(shape.frame, shape.points)
    if shape.direction is None:
        return replace(shape, points=points)
    ends = shown.seen(shape.frame, np.array([[0.0, 0.0], shape.direction]))
    return replace(shape, points=points, direction=ends[1] - ends[0])


def _links(shown: Instant, sliding: Sequence[Slide]) -> Iterator[Shape]:
    along = rods(shown, sliding)
    for body in shown.mechanism.moving_bodies:
        if body.name not in shown.poses:
            continue
        colour = shown.colour(body.name)
        corners, is_closed = rim(points_of(body))
        yield Shape("link", body.name, body.name, corners, colour, is_closed=is_closed)
        for ends in ribs(points_of(body)):
            yield Shape("rib", body.name, body.name, ends, colour)
        for ends in along.get(body.name, ()):
            yield Shape("rod", body.name, body.name, ends, colour)


def _between(shown: Instant) -> Iterator[Shape]:
    """Yield bars and cylinders, which lie along the first axis of their own frames."""
    for joint in shown.joints:
        if isinstance(joint, Distance):
            ends = np.array([[0.0, 0.0], [joint.length, 0.0]])
            yield Shape("bar", joint.name, bar_frame(joint.name), ends, palette.BAR)
    for driver in shown.drivers:
        if isinstance(driver, DistanceDriver):
            yield from _cylinder(shown, driver)


def _cylinder(shown: Instant, driver: DistanceDriver) -> Iterator[Shape]:
    """Yield the rod and the barrel of a driven distance, with lengths that follow from those over the run.

    If the piston cannot stay in the barrel over the run, it is not drawn, and the rod may project behind the barrel.
    """
    lengths = lengths_between(shown, driver.between)
    usual, shortest, longest = (float(of(lengths)) for of in (np.nanmedian, np.nanmin, np.nanmax))
    stroke = (longest - shortest) / (1.0 - _GUIDED - _FREE)
    tube = max(min(_OF_SHORTEST * shortest, max(_BARREL * usual, stroke)), _SMALLEST * usual)
    rod = max(longest - (1.0 - _GUIDED) * tube, 0.0)
    parts = strokes.shaft(has_piston=tube >= (1.0 - 1e-9) * stroke)
    barrel, end = cylinder_frames(driver.name)
    yield Shape("shaft", driver.name, end, np.array([[-rod, 0.0], [0.0, 0.0]]), palette.BAR, strips=parts)
    yield Shape("barrel", driver.name, barrel, np.array([[0.0, 0.0], [tube, 0.0]]), strips=strokes.barrel())


def _cams(shown: Instant) -> Iterator[Shape]:
    for cam in cam_shapes(shown):
        colour = shown.colour(cam.cam)
        if cam.profile is not None:
            yield Shape("cam", cam.joint, cam.cam, cam.profile, colour, is_closed=True)
        if cam.pitch is not None:
            yield Shape("pitch", cam.joint, cam.cam, cam.pitch, colour, is_closed=True)
        if cam.radius:
            yield Shape("roller", cam.joint, cam.follower, cam.roller[None], radius=cam.radius)
        if cam.face is not None:
            yield Shape("face", cam.joint, cam.follower, cam.face, shown.colour(cam.follower), direction=cam.away)
        if cam.contact is not None:
            yield Shape("contact", cam.joint, cam.follower, cam.contact[None])


def _slides(shown: Instant, sliding: Sequence[Slide], around: FloatArray, size: float) -> Iterator[Shape]:
    """Yield the moving parts of slides, and rails under blocks or under a fixed block through which a rod slides."""
    racks, middle = racks_of(shown), around.mean(axis=0)
    for slide in sliding:
        at, along = place(shown, slide)
        is_rack, is_on_ground = slide.slider in racks, slide.holder == GROUND_NAME
        if is_on_ground or (slide.slider == GROUND_NAME and not slide.turns):
            ends = slide.ends if is_on_ground else np.array([at, at])
            side = _outwards(along, at, middle)
            kind = "bed" if is_rack and is_on_ground else "rail"
            lines = strokes.rail(kind, float(np.hypot(*(ends[1] - ends[0]))), size)
            yield Shape(kind, slide.name, GROUND_NAME, ends, direction=side, strips=lines)
        if is_rack:
            continue  # the rack itself slides
        look: dict[str, Any] = {"direction": along, "strips": strokes.block()}
        if not slide.turns:
            yield Shape("block", slide.name, slide.slider, at[None], shown.colour(slide.slider), **look)
        elif is_on_ground:
            yield Shape("die", slide.name, die_frame(slide.name), at[None], palette.BAR, **look)
        else:
            ends = shown.placed(slide.holder, slide.ends)
            yield Shape("slot", slide.name, slide.holder, ends, shown.colour(slide.holder))


def _supports(shown: Instant) -> Iterator[Shape]:
    """Yield one support for each place of the ground that holds pins.

    Its names are those of the revolute joints and welds there, else of the points.
    """
    joints: dict[str, list[str]] = {}  # by point of the ground
    leaving: dict[tuple[float, float], list[FloatArray]] = {}  # vectors from a place to the points of its bodies
    mechanism = shown.mechanism
    members: list[Joint | Driver | Load] = [*mechanism.joints, *mechanism.drivers, *mechanism.loads]
    for member in members:
        for point, body in _held(member):
            at = shown.body_points[point]
            joints.setdefault(point, []).extend([member.name] if isinstance(member, Revolute | Fixed) else [])
            ends = _points(shown, body)
            if len(ends):
                leaving.setdefault(at, []).extend([*(ends - at), ends.mean(axis=0) - at])  # a plate covers its middle
    names: dict[tuple[float, float], list[str]] = {}
    for point, found in joints.items():
        names.setdefault(shown.body_points[point], []).extend(found or [point_of(point)])
    for at, found in names.items():
        side, text = _free_side(leaving.get(at, [])), ", ".join(dict.fromkeys(found))
        yield Shape("support", text, GROUND_NAME, np.array([at]), direction=side, strips=strokes.support())


def _held(member: Joint | Driver | Load) -> list[tuple[str, str]]:
    """Return the points 'ground.point' that a joint, a cylinder or a spring loads, each with the other body."""
    pairs: list[tuple[str, str]] = []
    if isinstance(member, (Revolute, Fixed, Distance, DistanceDriver, *BETWEEN)):
        pairs = [member.between, member.between[::-1]]
    elif isinstance(member, PointOnLine | CamRoller):
        pairs = [member.between[::-1]]
    return [(point, body_of(other)) for point, other in pairs if body_of(point) == GROUND_NAME]


def _free_side(vectors: Sequence[FloatArray]) -> FloatArray:
    """Return the side of a support: below if no vector points there, else the side furthest from all vectors."""
    longest = max((float(np.hypot(*vector)) for vector in vectors), default=0.0)
    directions = [vector / np.hypot(*vector) for vector in vectors if np.hypot(*vector) > 1e-6 * longest]
    crowded = [max((float(np.dot(side, way)) for way in directions), default=-1.0) for side in _SIDES]
    best = 0 if crowded[0] < _CROWDED else int(np.argmin(np.round(crowded, 6)))
    return np.array(_SIDES[best])


def _points(shown: Instant, body: str) -> FloatArray:
    """Return the points (k, 2) of a body in the world as drawn; none if its pose is unknown."""
    names = [name for name in shown.body_points if body_of(name) == body and body in shown.poses]
    return np.array([shown.point(name) for name in names]).reshape(-1, 2)


def _detail(shown: Instant) -> float:
    """Return the usual size of details in pictures of the whole run [length]."""
    count = max(map(len, shown.poses.values()), default=1)
    some = slice(None, None, max(count // _POSES, 1))
    points = [(name, at) for name, at in shown.body_points.items() if body_of(name) in shown.poses]
    tracks = np.array([world(shown.poses[body_of(name)][some], at) for name, at in points]).reshape(-1, 2)
    if not len(tracks):
        return 1.0
    return float((np.nanmax(tracks, axis=0) - np.nanmin(tracks, axis=0)).max()) / strokes.UNITS or 1.0


def _box(shown: Instant) -> FloatArray:
    """Return the lower left and upper right corner (2, 2) of all points as drawn."""
    points = np.vstack([_points(shown, body) for body in shown.poses])
    return np.array([points.min(axis=0), points.max(axis=0)] if len(points) else np.zeros((2, 2)))


def _outwards(along: FloatArray, at: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the unit vector across a line into the ground: down, or away from the mechanism if the line is steep."""
    across = np.array([along[1], -along[0]])
    is_steep = abs(along[1]) > _STEEP
    wanted = at - middle if is_steep and abs((at - middle) @ across) > 0.0 else np.array([-0.1, -1.0])
    return across if across @ wanted > 0.0 else -across
