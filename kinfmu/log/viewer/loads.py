"""Symbols of loads in the moving linkage of a recording: springs, dampers, forces and torques."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.shape import Shape
from kinfmu.log.viewer.linkage import Linkage

FORCES = ("force", "force_along", "force_between")  # kinds that the arrows of a run show to scale
_ORDER = 28.0  # above cylinders, below pins
_RADIUS = 0.9  # of lines [points of the screen]


class _Part(NamedTuple):
    """Lines of a symbol that move together: pose (n, 3), stretch along it (n,), lines (k, 2) in this frame."""

    name: str
    pose: FloatArray
    stretch: FloatArray
    lines: list[FloatArray]


def log_loads(linkage: Linkage, with_arrow: Collection[str] = ()) -> None:
    """Log the symbols of loads; those of forces only if they are not among the names of loads `with_arrow`."""
    import rerun as rr

    for load in linkage.scene.shapes:
        if not load.strips or (load.kind in FORCES and load.name in with_arrow):
            continue
        for part in _parts(load, linkage):
            entity = f"{linkage.root}/loads/{load.name}/{part.name}"
            linkage.frames.move(entity, part.pose, part.stretch)
            linkage.frames.lines(
                entity,
                part.lines,
                rr.Radius.ui_points(_RADIUS),
                linkage.colour or palette.LOAD_ON_DARK,
                _ORDER,
                load.name,
            )


def _parts(load: Shape, linkage: Linkage) -> Iterator[_Part]:
    """Yield the parts at the first point, at the second one, and what is stretched between them."""
    first, angle, distance = load.ends(linkage.scene.frames)
    second = first + distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    keeps = np.ones(len(angle))
    poses = {"first": (first, 0.0, keeps), "last": (second, 1.0, keeps), "between": (first, np.nan, distance)}
    found: dict[str, list[FloatArray]] = {}
    for strip in load.strips:
        part, length, along, across = strip.points.T
        (name,) = [key for key, (_, end, _) in poses.items() if (part == end).all()] or ["between"]
        ahead = part if name == "between" else length + linkage.detail * along
        line = np.column_stack([ahead, linkage.detail * across])
        found.setdefault(name, []).append(np.vstack([line, line[:1]]) if strip.is_area else line)
    for name, lines in found.items():
        at, _, stretch = poses[name]
        yield _Part(name, np.column_stack([at, angle]), stretch, lines)
