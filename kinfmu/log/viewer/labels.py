"""Choice of the names that are always shown, so that none covers another; the others show when pointed at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.shape import Shape

_SUPPORT = 0.05  # height of a support, as a part of the size
_WIDTH, _HEIGHT = 600.0, 380.0  # [points] of the view on a usual screen, within its frame
_LETTER, _EDGE, _LINE = 6.5, 8.0, 17.0  # [points]; of a name: width of a letter, margin, height
_SAMPLES = 40  # poses that are compared
_OFTEN = 0.35  # of them; of two names that cover each other in more poses only one is shown


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
    line, placed = _LINE / dots(scene), list[FloatArray]()
    for at in scene.supports.values():
        here = at - np.array([0.0, depth])
        while any(_covers(scene, here[None], a[None], b, c).any() for a, b, c in _pairs(scene, placed)):
            here = here - [0.0, line]
        placed.append(here)
    return np.array(placed).reshape(-1, 2)


def _pairs(scene: Scene, placed: Sequence[FloatArray]) -> list[tuple[FloatArray, str, str]]:
    """Return the supports' names that are placed, each with the name of the next one."""
    names = list(scene.supports)
    return [(at, names[len(placed)], name) for at, name in zip(placed, names, strict=False)]


def shown_names(scene: Scene) -> frozenset[str]:
    """Return the bodies and bars whose names are always shown; supports and points of interest have precedence."""
    count = max((len(pose) for pose in scene.frames.values()), default=0)
    rows = np.unique(np.linspace(0, max(count - 1, 0), _SAMPLES).astype(int)) if count else np.zeros(0, int)
    taken = [(name, path[rows]) for name, path in scene.paths.items()]
    taken += [(name, np.tile(at, (len(rows), 1))) for name, at in zip(scene.supports, places_below(scene), strict=True)]
    found = []
    middles = [
        (shape.name, world(scene.frames[shape.frame][rows], _middle(shape)))
        for shape in scene.shapes
        if shape.kind in ("link", "bar")
    ]
    for name, track in middles:
        covered = [_covers(scene, track, other, name, text) for text, other in taken]
        if all(overlap.sum() <= _OFTEN * len(rows) for overlap in covered):
            taken.append((name, track))
            found.append(name)
    return frozenset(found)


def _middle(shape: Shape) -> tuple[float, float]:
    """Return where the viewer puts the name of a line."""
    x, y = shape.line.mean(axis=0)
    return float(x), float(y)


def _covers(scene: Scene, a: FloatArray, b: FloatArray, first: str, second: str) -> FloatArray:
    """Return where two names at (n, 2) cover each other, (n,) of 1.0 or 0.0; 0.0 in gaps."""
    apart = np.abs(a - b) * dots(scene)
    width = 0.5 * _LETTER * (len(first) + len(second)) + _EDGE
    return np.asarray((apart[:, 0] < width) & (apart[:, 1] < _LINE), float)
