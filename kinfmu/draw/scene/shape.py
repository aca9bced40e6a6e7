"""What is drawn of a mechanism, once for all pictures and robot descriptions: shapes in moving frames.

A picture places the frames, and paints the strokes of each kind (see `strokes`). Frames are bodies, 'ground', or those
of `frames`: bars, cylinders, and the blocks of pins.

    link             a body's points: a closed plate or an open bar; rib: from a plate's corner to a point inside
    rod, slot        a line of a body on which another body slides, and the part of it in which a pin runs
    block, die       what slides: a body, or the block of a pin, which can turn; direction: along the line
    rail, bed        a line of the ground under blocks, and under a rack; direction: into the ground
    support          a pin of the ground; direction: into the ground
    cam, pitch       the profile, and the curve of the roller's centre; roller: its circle
    face             the line of a flat face on a cam; direction: away from the cam, the side on which the body is
    wheel, spoke     a pitch circle, and a radius that shows its rotation; belt: a straight part of one
    rack             the pitch line; direction: from the teeth to the back
    contact          the point where the bodies of a cam, gear or rack touch
    bar              a joint Distance; barrel, shaft: of a driven distance, at its first and at its second point
    spring, damper, gas_spring, force_between, force, force_along, torque, torsion_spring, torsion_damper
                     the symbol of a load of this type: one point, or two; direction: of a force, of a body's x axis
    driver           the arrow of a driver: one point; direction: from its pin along the body, or of its motion
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.placing import world
from kinfmu.mechanism.body import GROUND_NAME, Body
from kinfmu.mechanism.drivers import DistanceDriver, Driver
from kinfmu.mechanism.joints import CamRoller, Coordinate, Distance, Fixed, PointOnLine, Revolute
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import body_of

FLAT = 1e-6  # of the points' extent; points nearer to a line than that count as a line
_ROUND = np.linspace(0.0, 2.0 * np.pi, 73)  # [rad], corners of a circle
_LOADS = frozenset(load.type for load in LOADS)


class Strip(NamedTuple):
    """A line of a symbol: points (k, 4), each (part, length, along, across), and its row in the table of strokes.

    A point lies at `part` of the distance of the shape's two ends, plus a length of the mechanism, plus details along
    and across, whose size follows from the picture. A symbol at one point has parts and lengths of 0. Rows with an area
    are closed lines.
    """

    points: FloatArray
    stroke: str = "symbol"


@dataclass(frozen=True, eq=False)
class Shape:
    """A line, area or circle that is fixed in a frame.

    kind: see above; name: of the joint, body or driver it shows; frame: that moves it; points: (k, 2) in the frame;
    colour: of the body, or grey; is_closed: True for a line that returns to its first point; radius: of a circle about
    the only point; direction: unit vector (2,), as stated with the kinds; strips: the lines of a symbol. Of loads and
    drivers: other: the frame of the second of two points, else that of the direction.
    """

    kind: str
    name: str
    frame: str
    points: FloatArray
    colour: palette.Colour = palette.GROUND
    is_closed: bool = False
    radius: float = 0.0
    direction: FloatArray | None = None
    strips: tuple[Strip, ...] = ()
    other: str = ""

    @property
    def is_load(self) -> bool:
        """True for the symbol of a load."""
        return self.kind in _LOADS

    @property
    def is_effort(self) -> bool:
        """True for the symbol of a load or driver."""
        return self.is_load or self.kind == "driver"

    @property
    def is_bar(self) -> bool:
        """True for a line of a body besides its link."""
        return self.kind in ("rod", "face")

    @property
    def line(self) -> FloatArray:
        """The polyline (k, 2) in the frame; that of a circle or closed line returns to its first point."""
        if self.radius:
            return self.points + self.radius * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
        return np.vstack([self.points, self.points[:1]]) if self.is_closed else self.points

    @property
    def extent(self) -> FloatArray:
        """Some of the points of the line, (at most 25, 2)."""
        return self.line[:: max(len(self.line) // 24, 1)]

    @property
    def towards(self) -> FloatArray:
        """The direction of a kind that has one, (2,)."""
        if self.direction is None:
            raise TypeError(f"a shape of kind '{self.kind}' has no direction")
        return self.direction

    def placed(self, poses: Mapping[str, FloatArray]) -> Shape:
        """Return the shape in the world; poses: (3,) of all frames."""
        pose = poses[self.frame]
        ends = [pose] * len(self.points)
        if self.other and len(ends) > 1:
            ends[-1] = poses[self.other]
        points = np.array([world(end[None], (x, y))[0] for end, (x, y) in zip(ends, self.points, strict=True)])
        if self.direction is None:
            return replace(self, points=points.reshape(-1, 2))
        x, y = self.direction
        turn = poses[self.other or self.frame][2]
        direction = world(np.array([[0.0, 0.0, turn]]), (x, y))[0]
        return replace(self, points=points.reshape(-1, 2), direction=direction)

    def ends(self, poses: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the first point (n, 2) of a load, its angle [rad] and the distance of its ends (n,).

        poses: (n, 3) of all frames.
        """
        first, *last = [
            world(poses[frame], (float(x), float(y)))
            for frame, (x, y) in zip((self.frame, self.other), self.points, strict=False)
        ]
        if last:
            way = last[0] - first
            return first, np.arctan2(way[:, 1], way[:, 0]), np.hypot(*way.T)
        angle = math.atan2(self.towards[1], self.towards[0]) + poses[self.other or self.frame][:, 2]
        return first, angle, np.zeros(len(first))


def guides_of_cams(found: Iterable[Shape]) -> frozenset[str]:
    """Return the names of the blocks of followers, which are drawn behind their cams.

    In the middle of such a block is often a roller that is smaller than the block.
    """
    found = list(found)
    cams = {shape.name for shape in found if shape.kind == "cam"}
    followers = {shape.frame for shape in found if shape.kind == "contact" and shape.name in cams}
    return frozenset(shape.name for shape in found if shape.kind == "block" and shape.frame in followers)


def bar_frame(joint: str) -> str:
    """Return the frame of a bar, which begins at its first point and lies along it."""
    return f"bar.{joint}"  # names of bodies hold no dot


def cylinder_frames(driver: str) -> tuple[str, str]:
    """Return the frames of a cylinder's barrel and rod, each at its own pin and along the cylinder."""
    return f"cylinder.{driver}.barrel", f"cylinder.{driver}.rod"


def die_frame(joint: str) -> str:
    """Return the frame of the block of a pin, which moves with the pin and does not turn."""
    return f"die.{joint}"


def frames(poses: Mapping[str, FloatArray], mechanism: Mechanism) -> dict[str, FloatArray]:
    """Return poses (n, 3) of x, y [length], phi [rad] of all frames, from those of bodies, the ground included."""
    found, points = dict(poses), mechanism.body_points

    def track(point: str) -> FloatArray:
        return world(poses[body_of(point)], points[point])

    members: list[Joint | Driver] = [*mechanism.joints, *mechanism.drivers]
    for member in members:
        if not poses.keys() >= set(member.bodies()):
            continue
        if isinstance(member, Distance | DistanceDriver):
            a, b = map(track, member.between)
            angle = np.arctan2(b[:, 1] - a[:, 1], b[:, 0] - a[:, 0])
            at_a, at_b = np.column_stack([a, angle]), np.column_stack([b, angle])
            if isinstance(member, Distance):
                found[bar_frame(member.name)] = at_a
            else:
                found |= zip(cylinder_frames(member.name), (at_a, at_b), strict=True)
        elif isinstance(member, Coordinate):
            found[die_frame(member.name)] = _upright(track(member.of))
        elif isinstance(member, PointOnLine) and body_of(member.between[0]) == GROUND_NAME:
            found[die_frame(member.name)] = _upright(track(member.between[1]))
    return found


def _upright(track: FloatArray) -> FloatArray:
    """Return poses (n, 3) at points (n, 2) that do not turn, NaN where the points are unknown."""
    return np.column_stack([track, 0.0 * track[:, 0]])


def points_of(body: Body) -> FloatArray:
    """Return body-fixed points (p, 2); the frame's origin for a body without points."""
    return np.array([tuple(point) for point in body.points.values()] or [(0.0, 0.0)])


def distinct(points: FloatArray) -> FloatArray:
    """Return points (p, 2) sorted by x, then y, each once; numpy's `unique` imports masked arrays for this."""
    return np.array(sorted({*map(tuple, points.tolist())}))


def rim(points: FloatArray) -> tuple[FloatArray, bool]:
    """Return the corners (k, 2) of a link with these points (p, 2), and True if they are a closed line.

    Points on one line are all corners, in order; other points give their convex hull, counter-clockwise.
    """
    points = distinct(points)
    if len(points) < 3:
        return points, False
    centred = points - points.mean(axis=0)
    _, extents, directions = np.linalg.svd(centred, full_matrices=False)
    if extents[1] <= FLAT * extents[0]:
        return points[np.argsort(centred @ directions[0])], False
    return points[_hull(points)], True


def ribs(points: FloatArray) -> FloatArray:
    """Return lines (r, 2, 2) from the rim of a link with points (p, 2) to each point inside."""
    corners, is_closed = rim(points)
    inside = [point for point in distinct(points) if not (corners == point).all(axis=1).any()]
    if not is_closed:
        return np.empty((0, 2, 2))
    return np.array([[corners[np.argmin(np.hypot(*(corners - at).T))], at] for at in inside]).reshape(-1, 2, 2)


def _hull(points: FloatArray) -> list[int]:
    """Return indices of the convex hull of points sorted by x, then y; counter-clockwise (Andrew's monotone chain)."""

    def chain(order: range) -> list[int]:
        kept: list[int] = []
        for index in order:
            while len(kept) > 1:
                (a_x, a_y), (b_x, b_y) = points[kept[-1]] - points[kept[-2]], points[index] - points[kept[-2]]
                if a_x * b_y - a_y * b_x > 0.0:
                    break
                kept.pop()
            kept.append(index)
        return kept[:-1]

    return chain(range(len(points))) + chain(range(len(points) - 1, -1, -1))


def pins_of(joint: Joint) -> tuple[str, ...]:
    """Return points 'body.point' where a joint has a pin; those of a revolute joint coincide."""
    if isinstance(joint, Revolute | Fixed):
        return joint.between[:1]
    if isinstance(joint, Distance):
        return joint.between
    if isinstance(joint, PointOnLine | CamRoller):
        return joint.between[1:]
    return (joint.of,) if isinstance(joint, Coordinate) else ()
