"""The moving linkage of a recording, y up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.log.blocks import send
from kinfmu.log.scene import DrawnGuide, Scene
from kinfmu.run import FloatArray, Run
from kinfmu.shapes import palette
from kinfmu.shapes.placing import world

if TYPE_CHECKING:
    import rerun as rr

MARGIN = 0.12  # around the linkage, as a part of its size
MOST_NAMES = 12  # more names of bodies than this would hide the linkage; they show when pointed at
_BODY, _BAR, _PIN = 0.012, 0.006, 0.015  # radii, as parts of the size
_HATCH = 0.05  # height of a support, as a part of the size


def view_box(scene: Scene) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges of x and of the flipped y that show everything with a margin."""
    margin = MARGIN * scene.size
    low, high = scene.low - margin, scene.high + margin
    return (float(low[0]), float(high[0])), (float(-high[1]), float(-low[1]))


def log_linkage(
    rec: rr.RecordingStream,
    root: str,
    run: Run,
    scene: Scene,
    colour: palette.Colour | None = None,
    width: float = 1.0,
    layer: float = 0.0,
) -> None:
    """The linkage under the entity `root`: all in `colour`, or each body in its own. `width` scales the lines, and what
    has a higher `layer` covers what has a lower one.

    Where the run has no numbers the last pose that closed stays, in grey, with a notice; before the first pose there is
    nothing to draw.
    """
    import rerun as rr

    size = width * scene.size
    # Rerun's plane has y down; flipping the plane once keeps the logged numbers as they are.
    rec.log(root, rr.Transform3D(mat3x3=[[1, 0, 0], [0, -1, 0], [0, 0, 1]]), static=True)
    _log_ground(rec, root, scene)
    good = np.flatnonzero(run.good)
    named = colour is None and len(scene.bodies) <= MOST_NAMES
    for body in scene.bodies:
        path, own = f"{root}/bodies/{body.name}", colour or palette.body(body.index)
        look = rr.LineStrips2D.from_fields(
            radii=[_BODY * size], labels=[body.name], show_labels=named, draw_order=layer + 20.0 + body.index / 100
        )
        rec.log(path, look, static=True)
        corners = [world(body.pose[good], (x, y)) for x, y in body.outline]
        _send_strips(rec, path, run.t[good], np.stack(corners, axis=1))
        _send_colours(rec, path, run, own)
    for bar in scene.bars:
        path = f"{root}/bars/{bar.name}"
        rec.log(
            path,
            rr.LineStrips2D.from_fields(
                radii=[_BAR * size], labels=[bar.name], show_labels=named, draw_order=layer + 10.0
            ),
            static=True,
        )
        _send_strips(rec, path, run.t[good], bar.ends[good])
        _send_colours(rec, path, run, colour or palette.BAR)
    _log_points(
        rec,
        f"{root}/pins",
        run,
        scene.pins,
        rr.Points2D.from_fields(radii=[_PIN * size], colors=[palette.PIN], draw_order=layer + 30.0),
    )
    for index, (name, points) in enumerate(scene.paths.items()):
        own = colour or palette.body(len(scene.bodies) + index)
        _log_path(rec, f"{root}/paths/{name}", points, own)
        tip = rr.Points2D.from_fields(
            radii=[_PIN * size], colors=[own], labels=[name], show_labels=colour is None, draw_order=layer + 40.0
        )
        _log_points(rec, f"{root}/points/{name}", run, points[:, None, :], tip)
    _log_notice(rec, f"{root}/notice", run, scene)


def _send_strips(rec: rr.RecordingStream, path: str, t: FloatArray, strips: FloatArray) -> None:
    """One polyline a sample: strips (n, k, 2)."""
    import rerun as rr

    send(rec, path, t, lambda rows: rr.LineStrips2D.columns(strips=strips[rows].astype(np.float32)))


def _send_colours(rec: rr.RecordingStream, path: str, run: Run, colour: palette.Colour) -> None:
    """The own colour where there are numbers, grey where the last pose stands in; sent where it changes."""
    import rerun as rr

    turns = np.flatnonzero(np.diff(run.good.astype(int), prepend=-1))
    colours = np.array([colour if good else palette.OUT_OF_REACH for good in run.good[turns]], np.uint8).reshape(-1, 3)
    send(rec, path, run.t[turns], lambda rows: rr.LineStrips2D.columns(colors=colours[rows]))


def _log_points(rec: rr.RecordingStream, path: str, run: Run, points: FloatArray, look: rr.Points2D) -> None:
    """Points (n, p, 2) of the samples that hold numbers."""
    import rerun as rr

    good = np.flatnonzero(run.good)
    if not points.shape[1]:
        return
    rec.log(path, look, static=True)

    def columns(rows: slice) -> Any:
        block = points[good[rows]].astype(np.float32)
        flat = rr.Points2D.columns(positions=block.reshape(-1, 2))
        return flat.partition(np.full(len(block), points.shape[1]))

    send(rec, path, run.t[good], columns)


def _log_path(rec: rr.RecordingStream, path: str, points: FloatArray, colour: palette.Colour) -> None:
    """Where a point goes over the run, in one piece for each stretch without a gap."""
    import rerun as rr

    known = np.isfinite(points).all(axis=1)
    pieces = [piece for piece in np.split(points, np.flatnonzero(~known)) if len(piece)]
    pieces = [piece[np.isfinite(piece).all(axis=1)].astype(np.float32) for piece in pieces]
    pieces = [piece for piece in pieces if len(piece) > 1]
    if pieces:
        line = rr.LineStrips2D(pieces, colors=[colour], radii=rr.Radius.ui_points(1.2), draw_order=5.0)
        rec.log(path, line, static=True)


def _log_notice(rec: rr.RecordingStream, path: str, run: Run, scene: Scene) -> None:
    """Above the linkage, while the run has no numbers."""
    import rerun as rr

    if run.good.all():
        return
    place = [(scene.low[0] + scene.high[0]) / 2, scene.high[1] + 0.6 * MARGIN * scene.size]
    rec.log(path, rr.Points2D.from_fields(colors=[palette.STATUS[3]], radii=[0.0], show_labels=True), static=True)
    turns = np.flatnonzero(np.diff(run.good.astype(int), prepend=-1))
    lost = ~run.good[turns]
    before = ~np.maximum.accumulate(run.good)[turns]
    texts = [
        "no pose yet" if early else "no pose: the last one that closed, in grey"
        for early, gone in zip(before, lost, strict=True)
        if gone
    ]

    def columns(rows: slice) -> Any:
        counts = lost[rows].astype(int)
        first = int(lost[: rows.start].sum())
        labels = texts[first : first + int(counts.sum())]
        positions = np.tile(np.array(place, np.float32), (len(labels), 1))
        return [*rr.Points2D.columns(positions=positions, labels=labels).partition(counts)]

    send(rec, path, run.t[turns], columns)


def _log_ground(rec: rr.RecordingStream, root: str, scene: Scene) -> None:
    """Supports as triangles on hatched lines, and the lines on which points slide."""
    import rerun as rr

    strips: list[NDArray[Any]] = [
        np.array(point) + _HATCH * scene.size * stroke for point in scene.supports.values() for stroke in _support()
    ]
    strips += [_guide_line(guide, scene) for guide in scene.guides]
    if strips:
        lines = rr.LineStrips2D(strips, colors=[palette.GROUND], radii=rr.Radius.ui_points(0.9), draw_order=0.0)
        rec.log(f"{root}/ground", lines, static=True)
    if scene.supports:
        names = list(scene.supports)
        below = np.array(list(scene.supports.values())) - [0.0, 1.7 * _HATCH * scene.size]
        labels = rr.Points2D(
            below, labels=names, colors=[palette.GROUND], radii=[0.0], show_labels=len(names) <= MOST_NAMES
        )
        rec.log(f"{root}/ground/names", labels, static=True)


def _support() -> list[FloatArray]:
    """Strokes of a support for a pin at (0, 0), height 1: a triangle on a line with hatching below."""
    feet = np.array([[-0.6, -1.0], [0.6, -1.0]])
    triangle = np.vstack([[0.0, 0.0], feet, [0.0, 0.0]])
    line = np.array([[-1.0, -1.0], [1.0, -1.0]])
    hatching = [np.array([[x, -1.0], [x - 0.35, -1.45]]) for x in np.linspace(-0.75, 1.0, 6)]
    return [triangle, line, *hatching]


def _guide_line(guide: DrawnGuide, scene: Scene) -> FloatArray:
    margin = 0.5 * MARGIN * scene.size
    (left, bottom), (right, top) = scene.low - margin, scene.high + margin
    if guide.axis == "x":
        return np.array([[guide.value, bottom], [guide.value, top]])
    return np.array([[left, guide.value], [right, guide.value]])
