"""Slides: blocks on rails, rods through blocks, pins in slots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.draw.ground import Rail
from kinfmu.draw.instant import Instant
from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import BAR, PAPER, Sheet, box
from kinfmu.joints import Coordinate, PointOnLine, RackAndPinion, Translational
from kinfmu.joints.placement import body_of, unit_vector
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.shapes import palette
from kinfmu.shapes.outline import points_of
from kinfmu.shapes.placing import seen_from

HALF_LENGTH, HALF_WIDTH = 11.0, 7.0  # [pt], of a block
RACK_BACK = 11.0  # [pt]; from a rack's pitch line to its back
_REACH = 19.0  # [pt]; by which a rail goes beyond the middle of its block
_SLOT, _OPENING = 1.55, 0.75  # widths of a slotted link and of its slot beside that of a bar


@dataclass(frozen=True, eq=False)
class Slide:
    """A line fixed in one body, the holder, and the point of another that stays on it.

    origin: a point of the line, 'body.point', 'ground' if it has no name; point: the one that slides;
    ends: of the way over the run in the holder's frame, (2, 2); turns: True for a pin, which is free to turn, False for
    a block, which is not.
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


@dataclass(frozen=True, eq=False)
class Slot(Mark):
    """A slot along a moving link: ends (2, 2)."""

    ends: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        width, edge = BAR * sheet.fine, palette.darker(self.colour)
        along = self.ends[1] - self.ends[0]
        along = along / max(float(np.hypot(*along)), 1e-30)
        play = 0.4 * width * sheet.point * along  # the pin's own radius
        ends = np.array([self.ends[0] - play, self.ends[1] + play])
        sheet.line(ends, _SLOT * width + 0.9, edge)
        sheet.line(ends, _SLOT * width - 0.9, palette.lighter(self.colour), matters=0.0)
        sheet.line(ends, _OPENING * width + 0.8, edge, matters=0.0)
        sheet.line(ends, _OPENING * width - 0.8, PAPER, matters=0.0)
        return []


@dataclass(frozen=True, eq=False)
class Block(Mark):
    """A block that slides along a unit vector."""

    at: FloatArray
    along: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:
        size = sheet.ornament
        corners = box(self.at, self.along, HALF_LENGTH * size, HALF_WIDTH * size)
        edge, fill = palette.darker(self.colour), palette.lighter(self.colour)
        sheet.line(corners, 1.1, edge, closed=True, fill=fill, matters=1.5)
        return []


def slides(shown: Instant) -> list[Slide]:
    """All lines on which points slide; a held coordinate is a line of the ground."""
    found = []
    for joint in shown.mechanism.joints:
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
    """By moving body, ends (r, 2, 2) of its slots and rods in its own frame; each reaches to the origin of its line."""
    found: dict[str, list[FloatArray]] = {}
    for slide in sliding:
        if slide.holder != GROUND_NAME:
            origin = np.array(shown.body_points[slide.origin])
            line = [origin, *slide.ends]
            along = slide.ends[1] - slide.ends[0]
            order = np.argsort([float(point @ along) for point in line])
            found.setdefault(slide.holder, []).append(np.array([line[order[0]], line[order[-1]]]))
    return {body: np.array(ends) for body, ends in found.items()}


def rails(shown: Instant, sliding: Sequence[Slide]) -> list[Mark]:
    """The ground's part of slides: rails under blocks, and where a rod runs through a block that does not move."""
    moving = np.vstack([shown.point(f"{body}.{name}") for body, name in _points(shown)])
    middle = (moving.min(axis=0) + moving.max(axis=0)) / 2.0
    racks = _racks(shown)
    found: list[Mark] = []
    for slide in sliding:
        at, along = _place(shown, slide)
        if slide.holder == GROUND_NAME:
            lift = RACK_BACK if slide.slider in racks else HALF_WIDTH
            found.append(Rail(slide.name, slide.ends, _outwards(along, at, middle), lift, _REACH))
        elif slide.slider == GROUND_NAME and not slide.turns:
            ends = np.array([at, at])
            found.append(Rail(slide.name, ends, _outwards(along, at, middle), HALF_WIDTH, 1.4 * HALF_LENGTH))
    return found


def slots_and_blocks(shown: Instant, sliding: Sequence[Slide]) -> list[Mark]:
    """The moving part of slides."""
    racks = _racks(shown)
    found: list[Mark] = []
    for slide in sliding:
        at, along = _place(shown, slide)
        if slide.slider in racks:
            continue  # the rack itself slides
        if slide.turns and slide.holder != GROUND_NAME:
            found.append(Slot(shown.placed(slide.holder, slide.ends), shown.colour(slide.holder)))
        else:
            is_ours = slide.turns or slide.slider == GROUND_NAME  # a pin's block belongs to no body
            found.append(Block(at, along, palette.BAR if is_ours else shown.colour(slide.slider)))
    return found


def _ends(shown: Instant, a: str, b: str, axis: float) -> FloatArray:
    """Ends (2, 2) of the way of b along an axis [rad] through a, in the frame of a's body."""
    e = np.array(unit_vector(axis))
    origin = np.array(shown.body_points[a])
    way = (seen_from(shown.poses[body_of(a)], shown.track(b)) - origin) @ e
    return np.array([origin + np.nanmin(way) * e, origin + np.nanmax(way) * e])


def _place(shown: Instant, slide: Slide) -> tuple[FloatArray, FloatArray]:
    """Where the sliding point is, and the direction of its line."""
    first, last = slide.ends
    along = last - first
    if not np.hypot(*along) > 0.0:
        along = np.array([1.0, 0.0])
    ends = shown.placed(slide.holder, np.array([[0.0, 0.0], along / np.hypot(*along)]))
    return shown.point(slide.point), ends[1] - ends[0]


def _is_block(shown: Instant, body: str) -> bool:
    """True for a moving body that is no longer than its one point."""
    found = next(one for one in shown.mechanism.bodies if one.name == body)
    return body != GROUND_NAME and not np.ptp(points_of(found), axis=0).any()


def _racks(shown: Instant) -> set[str]:
    """Bodies that are drawn as racks."""
    joints = shown.mechanism.joints
    return {body_of(joint.between[1]) for joint in joints if isinstance(joint, RackAndPinion)}


def _points(shown: Instant) -> list[tuple[str, str]]:
    """All points, as body and name, of bodies that have any."""
    return [(body.name, name) for body in shown.mechanism.bodies for name in body.points]


def _outwards(along: FloatArray, at: FloatArray, middle: FloatArray) -> FloatArray:
    """Unit vector across a line into the ground: downwards, or away from the mechanism if the line is steep."""
    across = np.array([along[1], -along[0]])
    is_steep = abs(along[1]) > 0.9
    wanted = at - middle if is_steep and abs((at - middle) @ across) > 0.0 else np.array([-0.1, -1.0])
    return across if across @ wanted > 0.0 else -across
