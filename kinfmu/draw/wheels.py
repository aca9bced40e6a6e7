"""Gears and belts as pitch circles, racks with their pinions, cams with their rollers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import PAPER, Sheet, box
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.cams import CamShape, cam_shapes
from kinfmu.scene.instant import Instant
from kinfmu.scene.wheels import WheelShape, gear_pairs, rack_pairs

_TEETH = 9.0  # [pt], usual pitch of a rack's teeth
_TOOTH, _BACK = 4.0, 6.0  # [pt]; half height of the teeth, thickness of the rack without teeth
DASHES = (0, (7.0, 2.0, 1.5, 2.0))  # of a pitch circle


@dataclass(frozen=True, eq=False)
class Wheel(Mark):
    """A gear or pulley: its pitch circle, with a spoke that turns with it; angle: of the spoke [rad]."""

    centre: FloatArray
    radius: float
    angle: float
    colour: palette.Colour
    filled: bool = True

    def extent(self) -> FloatArray:
        return np.array([self.centre - self.radius, self.centre + self.radius])

    def draw(self, sheet: Sheet) -> list[Name]:
        edge = palette.darker(self.colour)
        light = palette.lighter(palette.lighter(palette.lighter(self.colour))) if self.filled else None
        sheet.circle(self.centre, self.radius, 1.0, edge, fill=light, style=DASHES, matters=0.6)
        spoke = self.centre + self.radius * np.array([np.cos(self.angle), np.sin(self.angle)])
        sheet.line([self.centre, spoke], 1.0, edge, matters=0.4)
        return []


@dataclass(frozen=True, eq=False)
class Belt(Mark):
    """The open belt around two pulleys: ends (2, 2, 2) of its two straight parts."""

    parts: FloatArray

    def extent(self) -> FloatArray:
        return self.parts.reshape(-1, 2)

    def draw(self, sheet: Sheet) -> list[Name]:
        for ends in self.parts:
            sheet.line(ends, 1.6, palette.darker(palette.GROUND), matters=0.6)
        return []


@dataclass(frozen=True, eq=False)
class Rack(Mark):
    """A toothed bar: ends (2, 2) of its pitch line; towards: unit vector from the teeth to its back."""

    ends: FloatArray
    towards: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        size = sheet.ornament
        along = self.ends[1] - self.ends[0]
        length = float(np.hypot(*along))
        along = along / length
        count = max(round(length / (_TEETH * size)), 2)
        pitch = length / count
        profile = ((0.0, 1.0), (0.25, 1.0), (0.4, -1.0), (0.6, -1.0), (0.75, 1.0))  # of one tooth: part of pitch, depth
        teeth = [
            self.ends[0] + (k + part) * pitch * along + depth * _TOOTH * size * self.towards
            for k in range(count)
            for part, depth in profile
        ]
        back = (_TOOTH + _BACK) * size * self.towards
        corners = [*teeth, self.ends[1] + _TOOTH * size * self.towards, self.ends[1] + back, self.ends[0] + back]
        edge, fill = palette.darker(self.colour), palette.lighter(self.colour)
        bar = box(self.ends.mean(axis=0), along, length / 2.0, (_TOOTH + 2.0) * size)  # the body's own bar, covered
        sheet.line(bar, 0.0, PAPER, closed=True, fill=PAPER, matters=0.0)
        sheet.line(corners, 0.9, edge, closed=True, fill=fill)
        sheet.line(self.ends, 0.7, edge, style=DASHES, matters=0.0)
        return []


@dataclass(frozen=True, eq=False)
class MeshName(Mark):
    """The name of two wheels, of a rack and its pinion, or of a cam and its follower, at the point of contact."""

    name: str
    at: FloatArray

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:  # noqa: ARG002  it is only a name
        return [Name(self.name, self.at[None], 3.0, palette.darker(palette.GROUND), italic=True, rank=4)]


def wheels(shown: Instant) -> list[Mark]:
    """Return gear pairs and belts; larger wheels are drawn first."""
    marks: list[Mark] = []
    for pair in gear_pairs(shown):
        marks += [_wheel(shown, wheel) for wheel in pair.wheels]
        if pair.is_belt:
            marks.append(Belt(pair.belt()))
        marks.append(MeshName(pair.joint, pair.meets))
    return sorted(marks, key=lambda mark: -mark.radius if isinstance(mark, Wheel) else 0.0)


def racks(shown: Instant) -> list[Mark]:
    """Return racks and their pinions; they are drawn over the links, since a rack is often a link too."""
    marks: list[Mark] = []
    for pair in rack_pairs(shown):
        marks.append(Rack(pair.ends, pair.towards, shown.colour(pair.rack)))
        marks.append(_wheel(shown, pair.pinion, filled=False))
        marks.append(MeshName(pair.joint, pair.contact))
    return marks


def _wheel(shown: Instant, wheel: WheelShape, *, filled: bool = True) -> Wheel:
    return Wheel(wheel.centre, wheel.radius, shown.angle(wheel.body), shown.colour(wheel.body), filled)


@dataclass(frozen=True, eq=False)
class Disc(Mark):
    """A cam in its body's colour, and its roller."""

    shape: CamShape
    colour: palette.Colour

    def extent(self) -> FloatArray:
        roller, radius = self.shape.roller, self.shape.radius
        return np.vstack([self.shape.pitch, roller - radius, roller + radius])

    def draw(self, sheet: Sheet) -> list[Name]:
        edge = palette.darker(self.colour)
        light = palette.lighter(palette.lighter(self.colour))
        shape, grey = self.shape, palette.darker(palette.GROUND)
        sheet.line(shape.profile, 1.2, edge, closed=True, fill=light, matters=1.0)
        sheet.line(shape.pitch, 0.7, edge, closed=True, style=DASHES, matters=0.3)
        sheet.circle(shape.roller, shape.radius, 1.0, grey, fill=PAPER, matters=0.8)
        return []


def cams(shown: Instant) -> list[Mark]:
    """All cams whose pitch curve is known."""
    shapes = cam_shapes(shown)
    return [
        mark
        for shape in shapes
        for mark in (Disc(shape, shown.colour(shape.cam)), MeshName(shape.joint, shape.contact))
    ]
