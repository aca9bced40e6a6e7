"""Cams: the profile, the pitch curve on which the roller's centre goes, and the roller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import PAPER, Sheet
from kinfmu.draw.wheels import DASHES, MeshName
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.cams import CamShape, cam_shapes
from kinfmu.scene.instant import Instant


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
