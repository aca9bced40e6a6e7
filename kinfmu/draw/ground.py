"""The ground: supports of pins and rails of slides, with hatching."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import Sheet
from kinfmu.drivers import DistanceDriver
from kinfmu.joints import Distance, Fixed, PointOnLine, Revolute
from kinfmu.measures.placement import body_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.instant import Instant

EDGE = palette.darker(palette.GROUND)
_HEIGHT, _HALF, _HATCH = 13.0, 8.0, 4.5  # [pt]
_CROWDED = 0.8  # cosine of the angle to a link; above it a support would hide the link
_SIDES = ((0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 1.0))  # of a support; below is preferred


@dataclass(frozen=True, eq=False)
class Support(Mark):
    """The support of a pin on the ground; towards: unit vector from the pin to the ground."""

    at: FloatArray
    towards: FloatArray

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:
        size = sheet.ornament
        along = np.array([-self.towards[1], self.towards[0]])
        foot = self.at + _HEIGHT * size * self.towards
        corners = [self.at, foot - _HALF * size * along, foot + _HALF * size * along]
        sheet.line(corners, 0.9, EDGE, closed=True, fill=palette.lighter(palette.BAR), matters=1.5)
        wide = 1.5 * _HALF * size * along
        hatched(sheet, np.array([foot - wide, foot + wide]), self.towards, size)
        return []


@dataclass(frozen=True, eq=False)
class Rail(Mark):
    """A straight line of the ground on which a block slides.

    ends: (2, 2); towards: unit vector into the ground; lift: distance of the rail from the line [pt], half of the
    block's height; reach: additional length at both ends [pt].
    """

    name: str
    ends: FloatArray
    towards: FloatArray
    lift: float
    reach: float

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        size = sheet.ornament
        first, last = line = self._line(sheet)
        hatched(sheet, line, self.towards, size)
        anchors = np.array([last + part * (first - last) for part in (0.05, 0.95, 0.25, 0.75, 0.5)])
        return [Name(self.name, anchors, _HATCH + 2.0, EDGE, italic=True, rank=4)]

    def _line(self, sheet: Sheet) -> FloatArray:
        size = sheet.ornament
        along = np.array([-self.towards[1], self.towards[0]])
        if along @ (self.ends[1] - self.ends[0]) < 0.0:
            along = -along
        down = self.lift * size * self.towards
        return np.array(
            [self.ends[0] + down - self.reach * size * along, self.ends[1] + down + self.reach * size * along]
        )


def hatched(sheet: Sheet, line: FloatArray, towards: FloatArray, size: float) -> None:
    """Draw a line (2, 2) with hatching on the side of the ground; size: [length] of a printer's point there."""
    length = float(np.hypot(*(line[1] - line[0])))
    along = (line[1] - line[0]) / length
    count = max(int(length / (4.5 * size)), 3)
    strokes = []
    for k in range(count):
        top = line[0] + along * length * (k + 0.8) / count
        strokes.append([top, top + _HATCH * size * (towards - 0.8 * along)])
    sheet.strokes(strokes, 0.6, EDGE)
    sheet.line(line, 1.1, EDGE, matters=1.5)
    sheet.cover(line + 0.5 * _HATCH * size * towards, 1.0)


def supports(shown: Instant) -> list[Mark]:
    """Return supports of all points of the ground that hold a pin."""
    leaving: dict[tuple[float, float], list[FloatArray]] = {}  # vectors from a pin of the ground to its bodies
    for member in (*shown.joints, *shown.drivers):
        if not isinstance(member, Revolute | Distance | DistanceDriver | Fixed | PointOnLine):
            continue
        for point, other in (member.between, member.between[::-1]):
            is_line = isinstance(member, PointOnLine) and point == member.between[0]
            if body_of(point) == GROUND_NAME and not is_line:
                at = shown.point(point)
                body = body_of(other)
                ends = [shown.point(f"{body}.{name}") for name in _points(shown, body)]
                ends.append(np.mean(ends, axis=0))  # a plate covers what lies between its points
                leaving.setdefault((float(at[0]), float(at[1])), []).extend(end - at for end in ends)
    return [Support(np.array(at), _free_side(vectors)) for at, vectors in leaving.items()]


def _points(shown: Instant, body: str) -> list[str]:
    return [name for one in shown.mechanism.bodies if one.name == body for name in one.points]


def _free_side(vectors: list[FloatArray]) -> FloatArray:
    """Return the side of a support: below if no vector points there, else the side furthest from all vectors."""
    longest = max(float(np.hypot(*vector)) for vector in vectors)
    directions = [vector / np.hypot(*vector) for vector in vectors if np.hypot(*vector) > 1e-6 * longest]
    crowded = [max((float(np.dot(side, way)) for way in directions), default=-1.0) for side in _SIDES]
    best = 0 if crowded[0] < _CROWDED else int(np.argmin(np.round(crowded, 6)))
    return np.array(_SIDES[best])
