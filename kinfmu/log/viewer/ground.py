"""The ground of a recording: supports, rails, fixed blocks, pins; and the choice of names that are always shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.mechanism.body import GROUND_NAME

if TYPE_CHECKING:
    import rerun as rr

MARGIN = 0.12  # around the linkage, as a part of its size
_SUPPORT = 0.05  # height of a support, as a part of the size
_WIDTH, _HEIGHT = 600.0, 380.0  # [points] of the view on a usual screen, within its frame
_LETTER, _EDGE, _LINE = 6.5, 8.0, 17.0  # [points]; of a name: width of a letter, margin, height
_SAMPLES = 40  # poses that are compared
_OFTEN = 0.35  # of them; of two names that cover each other in more poses only one is shown
_GRAVITY = 0.07  # of the size: length of the arrow of gravity
MOST_NAMES = 12  # more names would hide the linkage; they show when pointed at


def detail(scene: Scene) -> float:
    """Return the size of details of a recording [length]."""
    return _SUPPORT * scene.stroke / details.SUPPORT


def dots(scene: Scene) -> float:
    """Return the points of the screen per unit of length, where the view shows the whole linkage."""
    width, height = np.maximum(scene.high - scene.low, 1e-9 * scene.size)
    return float(min(_WIDTH / width, _HEIGHT / height))


def places_below(scene: Scene) -> FloatArray:
    """Return the places of the names of supports, (k, 2): below each, or lower where another name would cover it."""
    depth = 1.7 * _SUPPORT * scene.stroke
    line, placed = _LINE / dots(scene), dict[str, FloatArray]()
    for name, at in scene.supports.items():
        here = at - np.array([0.0, depth])
        while any(_covers(scene, here[None], there[None], name, other).any() for other, there in placed.items()):
            here = here - [0.0, line]
        placed[name] = here
    return np.array(list(placed.values())).reshape(-1, 2)


def shown_names(scene: Scene) -> frozenset[str]:
    """Return the bodies and bars whose names are always shown; supports and points of interest have precedence."""
    count = max((len(pose) for pose in scene.frames.values()), default=0)
    rows = np.unique(np.linspace(0, max(count - 1, 0), _SAMPLES).astype(int)) if count else np.zeros(0, int)
    taken = [(name, path[rows]) for name, path in scene.paths.items()]
    taken += [(name, np.tile(at, (len(rows), 1))) for name, at in zip(scene.supports, places_below(scene), strict=True)]
    found = []
    middles = [
        (shape.name, world(scene.frames[shape.frame][rows], tuple(shape.line.mean(axis=0).tolist())))  # of its line
        for shape in scene.shapes
        if shape.kind in ("link", "bar")
    ]
    for name, track in middles:
        covered = [_covers(scene, track, other, name, text) for text, other in taken]
        if all(overlap.sum() <= _OFTEN * len(rows) for overlap in covered):
            taken.append((name, track))
            found.append(name)
    return frozenset(found)


def _covers(scene: Scene, a: FloatArray, b: FloatArray, first: str, second: str) -> FloatArray:
    """Return where two names at (n, 2) cover each other, (n,) of 1.0 or 0.0; 0.0 in gaps."""
    apart = np.abs(a - b) * dots(scene)
    width = 0.5 * _LETTER * (len(first) + len(second)) + _EDGE
    return np.asarray((apart[:, 0] < width) & (apart[:, 1] < _LINE), float)


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
