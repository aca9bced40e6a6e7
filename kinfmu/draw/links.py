"""Links: bars and plates through the points of bodies, and massless bars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kinfmu.draw.mark import Mark
from kinfmu.draw.names import Name
from kinfmu.draw.sheet import BAR, Sheet
from kinfmu.joints import Distance
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.instant import Instant
from kinfmu.scene.outline import points_of, rim

_EDGE = 0.9  # [pt]
_NAMED_AT = (0.5, 0.35, 0.65, 0.2, 0.8)  # of the length of an edge, places for its name


@dataclass(frozen=True, eq=False)
class Link(Mark):
    """A moving body: corners (k, 2), around it if closed, else along it; rods: ends (r, 2, 2) of slots and rods."""

    name: str
    corners: FloatArray
    is_closed: bool
    rods: FloatArray
    colour: palette.Colour

    def extent(self) -> FloatArray:
        return np.vstack([self.corners, *self.rods])

    def draw(self, sheet: Sheet) -> list[Name]:
        width = BAR * sheet.fine
        clearance = width / 2.0 + 1.5
        edge, fill = palette.darker(self.colour), palette.lighter(self.colour)
        routes = [(self.corners, self.is_closed)] if len(self.corners) > 1 else []
        routes += [(rod, False) for rod in self.rods]
        if not routes:
            return [Name(self.name, self.corners, 2.0 * clearance, edge, italic=True, rank=3)]
        for route, is_closed in routes:  # all edges first, so that the parts look like one body
            sheet.line(route, width + _EDGE, edge, closed=is_closed, matters=0.8)
        for route, is_closed in routes:
            sheet.line(route, width - _EDGE, fill, closed=is_closed, fill=fill if is_closed else None, matters=0.0)
        edges = [ends for route, is_closed in routes for ends in pairwise([*route, *route[: int(is_closed)]])]
        edges.sort(key=lambda ends: -float(np.hypot(*(ends[1] - ends[0]))))
        anchors = [a + part * (b - a) for a, b in edges for part in _NAMED_AT]
        if self.is_closed:  # its name is inside, if it fits
            anchors, clearance = [self.corners.mean(axis=0), *anchors], 0.0
        return [Name(self.name, np.array(anchors), clearance, edge, italic=True, rank=2)]


@dataclass(frozen=True, eq=False)
class ThinBar(Mark):
    """A massless bar between two points (joint Distance): ends (2, 2)."""

    name: str
    ends: FloatArray

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        width = 0.45 * BAR * sheet.fine
        sheet.line(self.ends, width + _EDGE, palette.darker(palette.GROUND), matters=0.8)
        sheet.line(self.ends, width - _EDGE / 2.0, palette.lighter(palette.BAR), matters=0.0)
        anchors = np.array([self.ends[0] + part * (self.ends[1] - self.ends[0]) for part in _NAMED_AT])
        colour = palette.darker(palette.GROUND)
        return [Name(self.name, anchors, 0.3 * BAR * sheet.fine + 1.5, colour, italic=True, rank=2)]


def links(shown: Instant, rods: Mapping[str, FloatArray]) -> tuple[list[Mark], list[Mark]]:
    """Return all moving bodies and massless bars: the plates, which are drawn first, and the bars.

    rods: by body, ends (r, 2, 2) of its slots and rods in its own frame.
    """
    plates: list[Mark] = []
    bars: list[Mark] = []
    for index, body in enumerate(shown.mechanism.moving_bodies):
        corners, is_closed = rim(points_of(body))
        ends = rods.get(body.name, np.empty((0, 2, 2)))
        own = shown.placed(body.name, ends.reshape(-1, 2)).reshape(-1, 2, 2)
        link = Link(body.name, shown.placed(body.name, corners), is_closed, own, palette.body(index))
        (plates if is_closed else bars).append(link)
    thin: list[Mark] = [
        ThinBar(joint.name, np.array([shown.point(end) for end in joint.between]))
        for joint in shown.joints
        if isinstance(joint, Distance)
    ]
    return plates, thin + bars


def shortest(marks: list[Mark], size: float) -> float:
    """Return the length of the shortest link of a figure, `size` if there is none."""
    lengths = []
    for mark in marks:
        if isinstance(mark, Link | ThinBar):
            steps = np.diff(mark.ends if isinstance(mark, ThinBar) else mark.corners, axis=0)
            lengths += [length for length in np.hypot(*steps.T) if length > 1e-3 * size]
    return float(min(lengths, default=size))
