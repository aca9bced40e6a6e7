"""Slides: blocks on rails, rods through blocks, pins in slots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.draw.ground import Rail
from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import BAR, PAPER, Sheet, box
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.instant import Instant
from kinfmu.scene.slides import Slide, place, racks_of

HALF_LENGTH, HALF_WIDTH = 11.0, 7.0  # [pt], of a block
RACK_BACK = 11.0  # [pt], from a rack's pitch line to its back
_REACH = 19.0  # [pt], length of a rail beyond the middle of its block
_SLOT, _OPENING = 1.55, 0.75  # widths of a slotted link and of its slot, relative to a bar


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


def rails(shown: Instant, sliding: Sequence[Slide]) -> list[Mark]:
    """Return the rails of the ground: under blocks, and under a fixed block through which a rod slides."""
    moving = np.vstack([shown.point(f"{body}.{name}") for body, name in _points(shown)])
    middle = (moving.min(axis=0) + moving.max(axis=0)) / 2.0
    racks = racks_of(shown)
    found: list[Mark] = []
    for slide in sliding:
        at, along = place(shown, slide)
        if slide.holder == GROUND_NAME:
            lift = RACK_BACK if slide.slider in racks else HALF_WIDTH
            found.append(Rail(slide.name, slide.ends, _outwards(along, at, middle), lift, _REACH))
        elif slide.slider == GROUND_NAME and not slide.turns:
            ends = np.array([at, at])
            found.append(Rail(slide.name, ends, _outwards(along, at, middle), HALF_WIDTH, 1.4 * HALF_LENGTH))
    return found


def slots_and_blocks(shown: Instant, sliding: Sequence[Slide]) -> list[Mark]:
    """Return the moving parts of slides."""
    racks = racks_of(shown)
    found: list[Mark] = []
    for slide in sliding:
        at, along = place(shown, slide)
        if slide.slider in racks:
            continue  # the rack itself slides
        if slide.turns and slide.holder != GROUND_NAME:
            found.append(Slot(shown.placed(slide.holder, slide.ends), shown.colour(slide.holder)))
        else:
            is_grey = slide.turns or slide.slider == GROUND_NAME  # a pin's block is not part of a body
            found.append(Block(at, along, palette.BAR if is_grey else shown.colour(slide.slider)))
    return found


def _points(shown: Instant) -> list[tuple[str, str]]:
    """Return all points as body and name."""
    return [(body.name, name) for body in shown.mechanism.bodies for name in body.points]


def _outwards(along: FloatArray, at: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the unit vector across a line into the ground: down, or away from the mechanism if the line is steep."""
    across = np.array([along[1], -along[0]])
    is_steep = abs(along[1]) > 0.9
    wanted = at - middle if is_steep and abs((at - middle) @ across) > 0.0 else np.array([-0.1, -1.0])
    return across if across @ wanted > 0.0 else -across
