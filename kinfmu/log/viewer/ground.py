"""The ground of a recording: supports and rails with hatching, fixed blocks, cams and wheels, pins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.scene import Scene
from kinfmu.log.viewer.labels import detail, places_below
from kinfmu.mechanism.body import GROUND_NAME

if TYPE_CHECKING:
    import rerun as rr

_GRAVITY = 0.07  # of the size: length of the arrow of gravity
MOST_NAMES = 12  # more names would hide the linkage; they show when pointed at


def log_ground(rec: rr.RecordingStream, root: str, scene: Scene, pin: float) -> None:
    """Log everything that is fixed under the entity `root`.

    pin: radius of the pins [length].
    """
    import rerun as rr

    size = detail(scene)
    shapes = [
        shape for shape in scene.shapes if shape.frame == GROUND_NAME and shape.kind != "contact" and not shape.strips
    ]
    strips: list[FloatArray] = []
    for shape in shapes:
        if shape.kind == "support":
            triangle, line = details.support(shape, size)
            strips += [np.vstack([triangle, triangle[:1]]), line, *details.hatching(line, shape.towards, size)]
        elif shape.kind in ("rail", "bed"):
            line = details.rail(shape, size)
            strips += [line, *details.hatching(line, shape.towards, size)]
        elif shape.kind != "block":
            strips.append(shape.line)
    if strips:
        lines = rr.LineStrips2D(strips, colors=[palette.GROUND], radii=rr.Radius.ui_points(0.9), draw_order=0.0)
        rec.log(f"{root}/ground", lines, static=True)
    blocks = [shape for shape in shapes if shape.kind == "block"]
    if blocks:
        bushes = rr.LineStrips2D(
            [details.core(shape, size) for shape in blocks],
            colors=[palette.GROUND],
            radii=[details.BLOCK_WIDTH * size],
            labels=[shape.name for shape in blocks],
            show_labels=False,
            draw_order=1.0,
        )
        rec.log(f"{root}/ground/blocks", bushes, static=True)
    names = list(scene.supports)
    if names:
        labels = rr.Points2D(
            places_below(scene),
            labels=names,
            colors=[palette.GROUND],
            radii=[0.0],
            show_labels=len(names) <= MOST_NAMES,
        )
        rec.log(f"{root}/ground/names", labels, static=True)
    if scene.gravity is not None:
        _log_gravity(rec, f"{root}/ground/gravity", scene, scene.gravity)
    if GROUND_NAME in scene.pins:
        names, at = map(list, zip(*scene.pins[GROUND_NAME], strict=True))
        pins = rr.Points2D(at, labels=names, colors=[palette.PIN], radii=[pin], show_labels=False, draw_order=30.0)
        rec.log(f"{root}/ground/pins", pins, static=True)


def _log_gravity(rec: rr.RecordingStream, entity: str, scene: Scene, along: FloatArray) -> None:
    """Log an arrow along gravity in the upper left margin, which the linkage never enters, with a name behind it."""
    import rerun as rr

    middle = np.array([scene.low[0] - _GRAVITY * scene.size, scene.high[1]])
    arrow = _GRAVITY * scene.size * along
    look: dict[str, Any] = {"colors": [palette.GROUND]}
    lines = rr.Arrows2D(vectors=[arrow], origins=[middle - 0.5 * arrow], radii=rr.Radius.ui_points(1.8), **look)
    rec.log(entity, lines, static=True)
    name = rr.Points2D([middle - 1.3 * arrow], labels=["g"], radii=[0.0], show_labels=True, **look)
    rec.log(f"{entity}/name", name, static=True)
