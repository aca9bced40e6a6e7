"""Names of a recording's linkage that are always shown: of supports, and of bodies that others leave free; gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.strokes import SUPPORT

if TYPE_CHECKING:
    import rerun as rr

MARGIN = 0.12  # around the linkage, as a part of its size
_WIDTH, _HEIGHT = 600.0, 380.0  # [points] of the view on a usual screen, within its frame
_LETTER, _EDGE, _LINE = 6.5, 8.0, 17.0  # [points]; of a name: width of a letter, margin, height
_SAMPLES = 40  # poses that are compared
_OFTEN = 0.35  # of them; of two names that cover each other in more poses only one is shown
_GRAVITY = 0.07  # of the size: length of the arrow of gravity
MOST_NAMES = 12  # more names would hide the linkage; they show when pointed at


def dots(scene: Scene) -> float:
    """Return the points of the screen per unit of length, where the view shows the whole linkage."""
    width, height = np.maximum(scene.high - scene.low, 1e-9 * scene.size)
    return float(min(_WIDTH / width, _HEIGHT / height))


def places_below(scene: Scene) -> FloatArray:
    """Return the places of the names of supports, (k, 2): below each, or lower where another name would cover it."""
    depth = 1.7 * SUPPORT * scene.sizes.detail
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


def log_ground(rec: rr.RecordingStream, root: str, scene: Scene) -> None:
    """Log the names of supports, and the direction of gravity, under the entity `root`."""
    import rerun as rr

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
