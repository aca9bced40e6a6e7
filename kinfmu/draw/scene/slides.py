"""Slides: points that stay on lines of other bodies, with the part of the line that a run uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.outline import points_of
from kinfmu.draw.scene.placing import seen_from
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Coordinate, PointOnLine, RackAndPinion, Translational
from kinfmu.mechanism.quantities.placement import body_of, unit_vector


@dataclass(frozen=True, eq=False)
class Slide:
    """A line fixed in one body, the holder, and the point of another that stays on it.

    origin: a point of the line, 'body.point', or 'ground' if it has no name; point: the sliding point; ends: of its
    path over the run in the holder's frame, (2, 2); turns: True for a pin, which can turn, False for a block.
    """

    name: str
    origin: str
    point: str
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
    found = []
    for joint in shown.joints:
        if isinstance(joint, Coordinate):
            across = 0 if joint.axis == "x" else 1
            track = shown.track(joint.of)
            ends = np.array([np.nanmin(track, axis=0), np.nanmax(track, axis=0)])
            ends[:, across] = joint.value
            found.append(Slide(joint.name, GROUND_NAME, joint.of, ends, turns=True))
        elif isinstance(joint, PointOnLine):
            a, b = joint.between
            found.append(Slide(joint.name, a, b, _ends(shown, a, b, joint.axis), turns=True))
        elif isinstance(joint, Translational):
            a, b, axis = *joint.between, joint.axis
            if _is_block(shown, body_of(a)) and not _is_block(shown, body_of(b)):  # the line is that of the rod
                a, b, axis = b, a, axis - joint.angle
            found.append(Slide(joint.name, a, b, _ends(shown, a, b, axis), turns=False))
    return found


def rods(shown: Instant, sliding: Sequence[Slide]) -> dict[str, FloatArray]:
    """Return ends (r, 2, 2) of slots and rods by moving body, in its frame; each includes the origin of its line."""
    found: dict[str, list[FloatArray]] = {}
    for slide in sliding:
        if slide.holder != GROUND_NAME:
            origin = np.array(shown.body_points[slide.origin])
            line = [origin, *slide.ends]
            along = slide.ends[1] - slide.ends[0]
            order = np.argsort([float(point @ along) for point in line])
            found.setdefault(slide.holder, []).append(np.array([line[order[0]], line[order[-1]]]))
    return {body: np.array(ends) for body, ends in found.items()}


def _ends(shown: Instant, a: str, b: str, axis: float) -> FloatArray:
    """Return the ends (2, 2) of the path of b along an axis [rad] through a, in the frame of a's body."""
    e = np.array(unit_vector(axis))
    origin = np.array(shown.body_points[a])
    distance = (seen_from(shown.poses[body_of(a)], shown.track(b)) - origin) @ e
    return np.array([origin + np.nanmin(distance) * e, origin + np.nanmax(distance) * e])


def place(shown: Instant, slide: Slide) -> tuple[FloatArray, FloatArray]:
    """Return the place of the sliding point, and the unit vector of its line."""
    first, last = slide.ends
    along = last - first
    if not np.hypot(*along) > 0.0:
        along = np.array([1.0, 0.0])
    ends = shown.placed(slide.holder, np.array([[0.0, 0.0], along / np.hypot(*along)]))
    return shown.point(slide.point), ends[1] - ends[0]


def _is_block(shown: Instant, body: str) -> bool:
    """Return True for a moving body without extent, all of whose points coincide."""
    found = next(one for one in shown.mechanism.bodies if one.name == body)
    return body != GROUND_NAME and not np.ptp(points_of(found), axis=0).any()


def racks_of(shown: Instant) -> set[str]:
    """Return the bodies that are drawn as racks."""
    joints = shown.joints
    return {body_of(joint.between[1]) for joint in joints if isinstance(joint, RackAndPinion)}
