"""The gap of a mechanism that does not close: a red line between the two points of the open joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.names import Mark, Name
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.sheet import BAR, Sheet

_RED = palette.STATUS[3]


@dataclass(frozen=True, eq=False)
class GapMark(Mark):
    """A gap between two points: ends (2, 2), and its name."""

    ends: FloatArray
    text: str

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:
        sheet.line(self.ends, 2.2, _RED, matters=2.0)
        return [Name(self.text, self.ends.mean(axis=0)[None], 0.5 * BAR * sheet.fine + 1.0, _RED, rank=0)]


def gaps(shown: Instant) -> Iterator[GapMark]:
    """Yield the mark of the open joint, if it joins two points."""
    for joint in shown.joints:
        if shown.open_gap is not None and joint.name == shown.open_gap.joint:
            points = [point for point in getattr(joint, "between", ()) if point in shown.body_points]
            if len(points) == 2:
                yield GapMark(np.array([shown.point(point) for point in points]), shown.open_gap.text)


def gap_note(shown: Instant) -> str:
    """Return a sentence on the gap of a mechanism that does not close; '' for one that does."""
    gap = shown.open_gap
    return "" if gap is None else f"does not close: {gap.text} at {gap.joint}"
