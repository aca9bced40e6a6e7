"""Details whose size follows from the picture, not from the mechanism: supports, rails, blocks, teeth, hatching.

`size` is the length of one unit of detail; a figure's is a printer's point. All lines are in the frame of the shape.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.shape import FLAT, Shape, Strip

BLOCK, BLOCK_WIDTH = 11.0, 7.0  # half length and half width of a block
SUPPORT = 13.0  # height of a support
_HALF, _FOOT = 8.0, 12.0  # half widths of a support's triangle and of its line
_HATCH, _HATCH_STEP = 4.5, 4.5  # depth of hatching, usual distance of its strokes
_LIFT = {"rail": BLOCK_WIDTH, "bed": 11.0}  # from the line on which a block or rack slides to its rail
_REACH = 19.0  # of a rail beyond the middle of its block
TOOTH, RACK_BACK = 4.0, 6.0  # half height of a rack's teeth, thickness of the rack without teeth
_TOOTH_STEP = 9.0  # usual pitch of a rack's teeth
_OF_PINION = 0.25  # of the pinion's radius, from tooth to tooth
_TOOTH_PROFILE = ((0.0, 1.0), (0.25, 1.0), (0.4, -1.0), (0.6, -1.0), (0.75, 1.0))  # part of the pitch, depth


def box(centre: FloatArray, along: FloatArray, half_length: float, half_width: float) -> FloatArray:
    """Return the corners (4, 2) of a rectangle whose long side is along a unit vector."""
    length, width = half_length * along, half_width * np.array([-along[1], along[0]])
    return np.array(
        [centre - length - width, centre + length - width, centre + length + width, centre - length + width]
    )


def support(shape: Shape, size: float) -> tuple[FloatArray, FloatArray]:
    """Return the corners (3, 2) of a support's triangle, and the line (2, 2) to hatch below it."""
    (at,), towards = shape.points, shape.towards
    along = np.array([-towards[1], towards[0]]) * size
    foot = at + SUPPORT * size * towards
    return np.array([at, foot - _HALF * along, foot + _HALF * along]), np.array(
        [foot - _FOOT * along, foot + _FOOT * along]
    )


def rail(shape: Shape, size: float) -> FloatArray:
    """Return the line (2, 2) to hatch of a rail or bed."""
    first, last = shape.points
    towards = shape.towards
    along = np.array([-towards[1], towards[0]])
    if along @ (last - first) < 0.0:
        along = -along
    down, reach = _LIFT[shape.kind] * size * towards, _REACH * size * along
    return np.array([first + down - reach, last + down + reach])


def hatching(line: FloatArray, towards: FloatArray, size: float) -> FloatArray:
    """Return short lines (k, 2, 2) on the side of the ground of a line (2, 2)."""
    length = float(np.hypot(*(line[1] - line[0])))
    along = (line[1] - line[0]) / length
    count = max(int(length / (_HATCH_STEP * size)), 3)
    tops = line[0] + along * length * ((np.arange(count) + 0.8) / count)[:, None]
    return np.stack([tops, tops + _HATCH * size * (towards - 0.8 * along)], axis=1)


def ground_side(line: FloatArray, towards: FloatArray, size: float) -> FloatArray:
    """Return the middle line (2, 2) of the hatching."""
    return np.asarray(line + 0.5 * _HATCH * size * towards)


def teeth(rack: Shape, size: float) -> FloatArray:
    """Return the corners (k, 2) of a rack: teeth along its pitch line, a straight back."""
    (first, last), towards = rack.points, rack.towards
    length = float(np.hypot(*(last - first)))
    count = max(round(length / (_TOOTH_STEP * size)), 2)
    profile = [
        first + (k + part) / count * (last - first) + depth * TOOTH * size * towards
        for k in range(count)
        for part, depth in _TOOTH_PROFILE
    ]
    back = (TOOTH + RACK_BACK) * size * towards
    return np.array([*profile, last + TOOTH * size * towards, last + back, first + back])


def on_face(points: FloatArray, face: Shape, by: float) -> FloatArray:
    """Return points (k, 2) of a body, those on the line of its flat face shifted away from the cam by a length.

    A stroke of twice this width through them then touches the line of the face, and with it the cam.
    """
    off = np.abs((points - face.points[0]) @ face.towards)
    is_on = off <= FLAT * np.hypot(*(face.points[1] - face.points[0]))
    return np.asarray(points + by * is_on[:, None] * face.towards)


def core(block: Shape, size: float) -> FloatArray:
    """Return the line (2, 2) that looks like a block if it is drawn BLOCK_WIDTH to each side with round ends."""
    half = (BLOCK - 0.5 * BLOCK_WIDTH) * size * block.towards
    return np.array([block.points[0] - half, block.points[0] + half])


def symbol(load: Shape, size: float) -> Iterator[tuple[Strip, FloatArray]]:
    """Yield the strips of a load, each with its points (k, 2); parts of a cylinder stay between its ends."""
    start, along, length = load.points[0], load.direction, 0.0
    if along is None:
        length = float(np.hypot(*(load.points[1] - start)))
        along = (load.points[1] - start) / max(length, 1e-300)
    across = np.array([-along[1], along[0]])
    for strip in load.strips:
        part, own, detail, side = strip.points.T
        ahead = np.clip(part * length + own, 0.0, length) + size * detail
        yield strip, start + ahead[:, None] * along + size * side[:, None] * across


def teeth_size(radius: float) -> float:
    """Return the size of details whose teeth fit a pinion of a radius [length]."""
    return _OF_PINION * radius / _TOOTH_STEP
