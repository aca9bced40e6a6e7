"""The ground: supports of pins, rails of slides, hatched."""

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
_CROWDED = 0.8  # cosine to a link beyond which a support would hide it
_SIDES = ((0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 1.0))  # a support stands below where there is room


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
    """A straight line of the ground on which a block slides: ends (2, 2); towards: unit vector into the ground.

    lift: from the line to the rail [pt]: half of the block's height; reach: beyond the ends [pt].
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
    """A line (2, 2) with strokes on the side of the ground; size: of a usual point there [length]."""
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
    """Supports of all points of the ground that hold a pin."""
    held: dict[tuple[float, float], list[FloatArray]] = {}  # what leaves a pin of the ground, towards where
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
                held.setdefault((float(at[0]), float(at[1])), []).extend(end - at for end in ends)
    return [Support(np.array(at), _free_side(leaving)) for at, leaving in held.items()]


def _points(shown: Instant, body: str) -> list[str]:
    return [name for one in shown.mechanism.bodies if one.name == body for name in one.points]


def _free_side(leaving: list[FloatArray]) -> FloatArray:
    """Below if nothing goes there, else the side that is furthest from everything."""
    furthest = max(float(np.hypot(*way)) for way in leaving)
    ways = [way / np.hypot(*way) for way in leaving if np.hypot(*way) > 1e-6 * furthest]
    crowded = [max((float(np.dot(side, way)) for way in ways), default=-1.0) for side in _SIDES]
    best = 0 if crowded[0] < _CROWDED else int(np.argmin(np.round(crowded, 6)))
    return np.array(_SIDES[best])
