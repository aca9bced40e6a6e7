"""Force arrows of a recording, at the joints and loads of the moving linkage, and their legend."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.draw.scene import palette
from kinfmu.draw.scene.forces import Arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.log.viewer.linkage import MARGIN, Linkage, send

if TYPE_CHECKING:
    import rerun as rr

_JOINT = (185, 28, 28)
_ORDER = 50.0  # above the linkage
_PLACES, _LOWEST_PART = 9, 0.2  # places of the legend; part of the size above the lowest point, in which names matter
_RADIUS = 0.004  # as a part of the scene's size, however thin its links are


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
        "radii": [_RADIUS * max(linkage.size, scene.size)],
        "draw_order": linkage.layer + _ORDER,
    }
    for name, along in found.along.items():
        kind, _, label = name.partition(".")
        entity, colour = f"{path}/{kind}/{label}", palette.LOAD_ON_DARK if kind == "loads" else _JOINT
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
