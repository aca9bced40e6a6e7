"""Loads and forces in the moving linkage of a recording: symbols of loads, arrows at joints and loads, their legend."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.forces import Arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.strokes import STROKES
from kinfmu.log.viewer.ground import MARGIN
from kinfmu.log.viewer.linkage import Linkage, RecordedLine, filled
from kinfmu.log.viewer.timeline import send

if TYPE_CHECKING:
    import rerun as rr

FORCES = ("force", "force_along", "force_between")  # kinds that the arrows of a run show to scale
_LOAD_RADIUS = 0.75  # of lines, as a part of their width [points of the screen]
_LOAD, _JOINT = palette.tint("own", palette.LOAD, is_dark=True), (185, 28, 28)
_ARROW_ORDER = 95.0  # above the linkage
_PLACES, _LOWEST_PART = 9, 0.2  # places of the legend; part of the size above the lowest point, in which names matter
_ARROW_RADIUS = 0.004  # as a part of the scene's size, however thin its links are


class _Part(NamedTuple):
    """Lines of a symbol that move together: pose (n, 3), stretch along it (n,), lines in this frame."""

    name: str
    pose: FloatArray
    stretch: FloatArray
    lines: list[RecordedLine]


def log_loads(linkage: Linkage, with_arrow: Collection[str] = ()) -> None:
    """Log the symbols of loads and drivers; those of forces only if they are not among the loads `with_arrow`."""
    for shape in linkage.scene.shapes:
        if not shape.is_effort or (shape.kind in FORCES and shape.name in with_arrow):
            continue
        for part in _parts(shape, linkage):
            kind = "drivers" if shape.kind == "driver" else "loads"
            entity = f"{linkage.root}/{kind}/{shape.name}/{part.name}"
            linkage.frames.move(entity, part.pose, part.stretch)
            linkage.frames.lines(entity, part.lines, STROKES["symbol"][0].order, shape.name)


def _parts(shape: Shape, linkage: Linkage) -> Iterator[_Part]:
    """Yield the parts at the first point, at the second one, and what is stretched between them."""
    first, angle, distance = shape.ends(linkage.scene.frames)
    second = first + distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    keeps, size = np.ones(len(angle)), linkage.sizes.detail
    poses = {"first": (first, 0.0, keeps), "last": (second, 1.0, keeps), "between": (first, np.nan, distance)}
    found: dict[str, list[RecordedLine]] = {}
    for strip in shape.strips:
        part, length, along, across = strip.points.T
        (name,) = [key for key, (_, end, _) in poses.items() if (part == end).all()] or ["between"]
        ahead = part if name == "between" else length + size * along
        points, (stroke,) = np.column_stack([ahead, size * across]), STROKES[strip.stroke]
        colour = palette.tint(stroke.line, linkage.colour or shape.colour, is_dark=True)
        if stroke.fill and name != "between":
            area = palette.tint(stroke.fill, linkage.colour or shape.colour, is_dark=True)
            found.setdefault(name, []).extend(filled(points, area, 0.5 * size))
        line = np.vstack([points, points[:1]]) if stroke.fill else points
        found.setdefault(name, []).append(RecordedLine(line, -_LOAD_RADIUS * stroke.width, colour))
    for name, lines in found.items():
        at, _, stretch = poses[name]
        yield _Part(name, np.column_stack([at, angle]), stretch, lines)


def legend_start(scene: Scene, length: float) -> float:
    """Return x where the arrow of the legend begins: below the linkage, off the names of supports there.

    Of some places from left to right it is the one whose middle is furthest from them; the first one of equal ones.
    """
    low, high = scene.low, scene.high
    deepest = low[1] + _LOWEST_PART * scene.size
    below = np.array([at[0] for at in scene.supports.values() if at[1] < deepest])
    starts = np.linspace(low[0], max(float(high[0]) - length, float(low[0])), _PLACES)
    apart = np.abs(starts[:, None] + 0.5 * length - below).min(axis=1, initial=length)  # further away is as good
    return float(starts[int(np.argmax(np.round(apart / scene.size, 6)))])


def log_arrows(linkage: Linkage, found: Arrows | None) -> frozenset[str]:
    """Log the forces of joints and loads, as the scene scales them, and return the names of these loads.

    Samples without numbers have no arrows.
    """
    import rerun as rr

    run, scene, path = linkage.run, linkage.scene, f"{linkage.root}/forces"
    if found is None:
        return frozenset()
    look: dict[str, Any] = {
        "radii": [_ARROW_RADIUS * scene.size],
        "draw_order": linkage.layer + _ARROW_ORDER,
    }
    for name, along in found.along.items():
        kind, _, label = name.partition(".")
        entity, colour = f"{path}/{kind}/{label}", _LOAD if kind == "loads" else _JOINT
        known = np.asarray(np.isfinite(along + found.at[name]).all(axis=1))
        linkage.rec.log(
            entity, rr.Arrows2D.from_fields(**look, colors=[colour], labels=[label], show_labels=False), static=True
        )
        tails, vectors = found.at[name].astype(np.float32), along.astype(np.float32)

        def columns(
            rows: slice, known: Any = known, tails: Any = tails, vectors: Any = vectors
        ) -> Iterable[rr.ComponentColumn]:
            chosen = known[rows]
            columns = rr.Arrows2D.columns(origins=tails[rows][chosen], vectors=vectors[rows][chosen])
            return columns.partition(chosen.astype(int))

        send(linkage.rec, entity, linkage.timeline, run.t, columns)
    corner = [legend_start(scene, found.length), float(scene.low[1] - 0.6 * MARGIN * scene.size)]
    linkage.rec.log(
        f"{path}/legend",
        rr.Arrows2D(
            origins=[corner],
            vectors=[[found.length, 0.0]],
            labels=[found.legend],
            show_labels=True,
            colors=[_JOINT],
            **look,
        ),
        static=True,
    )
    return frozenset(name.removeprefix("loads.") for name in found.along if name.startswith("loads."))
