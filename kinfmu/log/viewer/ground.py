"""The ground of a recording: supports, rails and other fixed parts, with hatching."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.log.viewer.labels import SUPPORT, places_below
from kinfmu.run import FloatArray
from kinfmu.scene import palette
from kinfmu.scene.scene import Scene
from kinfmu.scene.strokes import Stroke

if TYPE_CHECKING:
    import rerun as rr

MOST_NAMES = 12  # more names would hide the linkage; they show when pointed at


def log_ground(rec: rr.RecordingStream, root: str, scene: Scene, pin: float) -> None:
    """Log supports as triangles on hatched lines, rails, and other fixed parts, under the entity `root`.

    pin: radius of the pins [length].
    """
    import rerun as rr

    height = SUPPORT * scene.stroke
    strips: list[NDArray[Any]] = [
        np.array(point) + height * stroke for point in scene.supports.values() for stroke in _support()
    ]
    for stroke in scene.ground:
        if stroke.name.startswith("rail/"):
            strips += _rail(stroke, height)
        elif stroke.name.startswith("block/"):
            strips += _under(stroke, height, scene.stroke)
        else:
            strips.append(stroke.points)
    if strips:
        lines = rr.LineStrips2D(strips, colors=[palette.GROUND], radii=rr.Radius.ui_points(0.9), draw_order=0.0)
        rec.log(f"{root}/ground", lines, static=True)
    blocks = [stroke for stroke in scene.ground if stroke.name.startswith("block/")]
    if blocks:
        radii = [stroke.radius * scene.stroke for stroke in blocks]
        names = [stroke.name.partition("/")[2] for stroke in blocks]
        bushes = rr.LineStrips2D(
            [stroke.points for stroke in blocks],
            colors=[palette.GROUND],
            radii=radii,
            labels=names,
            show_labels=False,
            draw_order=1.0,
        )
        rec.log(f"{root}/ground/blocks", bushes, static=True)
    if scene.supports:
        names = list(scene.supports)
        below = places_below(scene)
        labels = rr.Points2D(
            below, labels=names, colors=[palette.GROUND], radii=[0.0], show_labels=len(names) <= MOST_NAMES
        )
        rec.log(f"{root}/ground/names", labels, static=True)
    if scene.pins:
        names, at = map(list, zip(*scene.pins, strict=True))
        pins = rr.Points2D(at, labels=names, colors=[palette.PIN], radii=[pin], show_labels=False, draw_order=30.0)
        rec.log(f"{root}/ground/pins", pins, static=True)


def _support() -> list[FloatArray]:
    """Return the lines of a support for a pin at (0, 0), height 1: a triangle on a line with hatching below."""
    feet = np.array([[-0.6, -1.0], [0.6, -1.0]])
    triangle = np.vstack([[0.0, 0.0], feet, [0.0, 0.0]])
    line = np.array([[-1.0, -1.0], [1.0, -1.0]])
    return [triangle, line, *_hatching(line[0], line[1], 0.45)]


def _rail(rail: Stroke, height: float) -> list[FloatArray]:
    """Return the lines of a rail, longer than the path of its slide, with hatching on the side of the ground."""
    first, last = rail.points
    length = float(np.hypot(*(last - first)))
    along = (last - first) / length if length > 0.0 else np.array([1.0, 0.0])
    if along[0] < 0.0:
        first, last, along = last, first, -along  # so that the ground is below
    down = 0.5 * height * np.array([along[1], -along[0]])
    line = np.array([first - 0.8 * height * along, last + 0.8 * height * along]) + down
    return [line, *_hatching(line[0], line[1], 0.45 * height)]


def _under(block: Stroke, height: float, size: float) -> list[FloatArray]:
    """Return the hatched line under a block of the ground, through which a body slides."""
    first, last = block.points if block.points[0, 0] <= block.points[-1, 0] else block.points[::-1]
    along = (last - first) / (float(np.hypot(*(last - first))) or 1.0)
    down = block.radius * size * np.array([along[1], -along[0]])
    line = np.array([first - 0.8 * height * along, last + 0.8 * height * along]) + down
    return [line, *_hatching(line[0], line[1], 0.45 * height)]


def _hatching(first: FloatArray, last: FloatArray, depth: float) -> list[FloatArray]:
    """Return hatching on the right side of a line, looking along it."""
    length = float(np.hypot(*(last - first)))
    along = (last - first) / length
    count = max(round(length / (0.8 * depth)), 3)
    right = np.array([along[1], -along[0]])
    tops = first + np.linspace(0.12, 1.0, count)[:, None] * (last - first)
    return [np.array([top, top + depth * (right - 0.75 * along)]) for top in tops]
