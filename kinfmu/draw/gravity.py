"""The direction of gravity: a small arrow in a free corner of a figure, or in the margin of an animation."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.names import Name
from kinfmu.draw.scene.gravity import gravity_direction
from kinfmu.draw.sheet import GREY, Sheet
from kinfmu.mechanism import Mechanism

_BOX, _LENGTH = 44.0, 26.0  # [pt]; side of the free square, length of the arrow
_SMALL, _LETTER = 22.0, 8.0  # [pt]; length of the arrow in the margin of an animation, distance of its letter
_CORNERS = ((0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0))  # of the sheet; the note is in the last one
_EDGE, _BELOW_NOTE = 4.0, 14.0  # [pt] from the edge of the sheet
_HEAD, _HALF_HEAD = 6.0, 2.4  # [pt]


def gravity(sheet: Sheet, mechanism: Mechanism) -> list[Name]:
    """Draw the direction of gravity, if bodies have masses and a corner of the sheet is free, and return its name."""
    along = gravity_direction(mechanism)
    if along is None:
        return []
    for corner in _CORNERS:
        middle = _middle(sheet, np.array(corner))
        near = np.abs(sheet.covered[:, :2] - middle) < 0.5 * _BOX
        if not near.all(axis=1).any():
            _arrow(sheet, middle, _LENGTH * along)
            return [Name("g", sheet.low + middle[None] * sheet.point, 4.0, GREY, italic=True, rank=5)]
    return []


def gravity_in_margin(sheet: Sheet, mechanism: Mechanism) -> None:
    """Draw the direction of gravity with its letter in the margin of an animation, which the linkage never enters."""
    along = gravity_direction(mechanism)
    if along is None:
        return
    top = float(sheet.to_paper(sheet.high)[1])
    middle = np.array([_EDGE, top - _EDGE]) + 0.5 * _SMALL * np.array([1.0, -1.0])
    _arrow(sheet, middle, _SMALL * along)
    aside = np.array([1.0, 0.0]) if abs(along[1]) >= abs(along[0]) else np.array([0.0, -1.0])
    sheet.text(middle + _LETTER * aside, "g", GREY, italic=True)


def _middle(sheet: Sheet, corner: FloatArray) -> FloatArray:
    """Return the middle of the square in a corner [pt]."""
    inside = (0.5 * _BOX + _EDGE) * (1.0 - 2.0 * corner)
    return np.asarray(corner * sheet.to_paper(sheet.high) + inside - [0.0, _BELOW_NOTE * (corner == 1.0).all()])


def _arrow(sheet: Sheet, middle: FloatArray, arrow: FloatArray) -> None:
    """Draw an arrow (2,) about its middle [pt]."""
    along = arrow / np.hypot(*arrow)
    across = np.array([-along[1], along[0]])
    tip, base = middle + 0.5 * arrow, middle + 0.5 * arrow - _HEAD * along
    head = [tip, base + _HALF_HEAD * across, base - _HALF_HEAD * across]

    def world(points: list[FloatArray]) -> FloatArray:
        return np.asarray(sheet.low + np.array(points) * sheet.point)

    sheet.line(world([middle - 0.5 * arrow, base]), 1.0, GREY)
    sheet.line(world(head), 0.4, GREY, closed=True, fill=GREY)
