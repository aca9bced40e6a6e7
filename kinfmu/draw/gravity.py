"""The direction of gravity: a small arrow in a free corner of a figure."""

from __future__ import annotations

import numpy as np

from kinfmu.draw.names import Name
from kinfmu.draw.sheet import GREY, Sheet
from kinfmu.mechanism import Mechanism
from kinfmu.run import FloatArray

_BOX, _LENGTH = 44.0, 26.0  # [pt]; side of the free square, length of the arrow
_CORNERS = ((0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0))  # of the sheet; the note is in the last one
_EDGE, _BELOW_NOTE = 4.0, 14.0  # [pt] from the edge of the sheet
_HEAD, _HALF_HEAD = 6.0, 2.4  # [pt]


def gravity(sheet: Sheet, mechanism: Mechanism) -> list[Name]:
    """Draw the direction of gravity, if bodies have masses and a corner of the sheet is free, and return its name."""
    pull = np.array(mechanism.gravity or (0.0, 0.0), dtype=float)
    if not pull.any() or not any(body.mass for body in mechanism.moving_bodies):
        return []
    for corner in _CORNERS:
        middle = _middle(sheet, np.array(corner))
        near = np.abs(sheet.covered[:, :2] - middle) < 0.5 * _BOX
        if not near.all(axis=1).any():
            return [_arrow(sheet, middle, pull / np.hypot(*pull))]
    return []


def _middle(sheet: Sheet, corner: FloatArray) -> FloatArray:
    """Return the middle of the square in a corner [pt]."""
    inside = (0.5 * _BOX + _EDGE) * (1.0 - 2.0 * corner)
    return np.asarray(corner * sheet.to_paper(sheet.high) + inside - [0.0, _BELOW_NOTE * (corner == 1.0).all()])


def _arrow(sheet: Sheet, middle: FloatArray, along: FloatArray) -> Name:
    """Draw the arrow and return its name."""
    across = np.array([-along[1], along[0]])
    tip, base = middle + 0.5 * _LENGTH * along, middle + (0.5 * _LENGTH - _HEAD) * along
    head = [tip, base + _HALF_HEAD * across, base - _HALF_HEAD * across]

    def world(points: list[FloatArray]) -> FloatArray:
        return np.asarray(sheet.low + np.array(points) * sheet.point)

    sheet.line(world([middle - 0.5 * _LENGTH * along, base]), 1.0, GREY)
    sheet.line(world(head), 0.4, GREY, closed=True, fill=GREY)
    return Name("g", world([middle]), 4.0, GREY, italic=True, rank=5)
