"""Robot description of a record: links of simple shapes as URDF, and the poses of their frames."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.placing import poses_of
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.shape import Shape, die_frame, distinct, frames
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import Run

ROOT = "ground"  # the root frame
_WIDTH, _BLOCK = 0.02, 0.03  # width of links and half length of blocks, as parts of the size


class _Paint(NamedTuple):
    """How one kind is drawn: width, relative to links; height above the body, in widths; has discs at its points."""

    width: float
    height: float = 0.0
    has_discs: bool = False


_PAINT = {  # kinds whose size follows from one pose
    "support": _Paint(1.0, has_discs=True),
    "link": _Paint(1.0, has_discs=True),
    "rib": _Paint(1.0, has_discs=True),
    "bar": _Paint(0.6, has_discs=True),
    "barrel": _Paint(1.4),
    "shaft": _Paint(0.6),
    "block": _Paint(1.8),
    "roller": _Paint(0.4, 1.2),  # on the block of its follower
    **dict.fromkeys(("cam", "wheel", "spoke", "belt"), _Paint(0.4, -0.3)),
}


def link_poses(run: Run, mechanism: Mechanism) -> dict[str, FloatArray]:
    """Return poses (n, 3) of x, y [length], phi [rad] of every link of the description: bodies, bars, cylinders."""
    known = poses_of(run, mechanism)[0] | {GROUND_NAME: np.zeros((len(run), 3))}
    found = frames(known, mechanism)
    unused = {GROUND_NAME, *(die_frame(joint.name) for joint in mechanism.joints)}
    return {name: pose for name, pose in found.items() if name not in unused}


def robot_description(name: str, scene: Scene, metres: float) -> str:
    """Return the URDF of the scene; a floating joint connects each link to ROOT, since closed loops are not a tree.

    metres: length of the mechanism's unit [m]. Each link has its own layer, so that none hides another. Only shapes
    whose size follows from one pose are drawn: a record that grows does not know the later poses. For the same reason a
    cylinder's rod is as long as the cylinder is in that pose.
    """
    brush = _Brush(scene.size, metres)
    dies = {shape.frame for shape in scene.shapes if shape.kind == "die"}
    links: dict[str, list[str]] = {frame: [] for frame in (ROOT, *scene.frames) if frame not in dies}
    for shape in scene.shapes:
        if shape.kind in _PAINT:
            links[shape.frame] += brush.visuals(shape, _layer(scene, shape), _line(scene, shape))
    lines = [f'<link name="{escape(link)}">{"".join(visuals)}</link>' for link, visuals in links.items()]
    lines += [
        f'<joint name="{escape(link)}_floats" type="floating">'
        f'<parent link="{ROOT}"/><child link="{escape(link)}"/></joint>'
        for link in links
        if link != ROOT
    ]
    body_lines = "\n".join(lines)
    return f'<?xml version="1.0"?>\n<robot name="{escape(name)}">\n{body_lines}\n</robot>\n'


def _layer(scene: Scene, shape: Shape) -> int:
    """Return the height of a shape's frame, in widths of links: bars below the ground, cylinders above all bodies."""
    if shape.kind == "bar":
        return -1
    if shape.kind in ("barrel", "shaft"):
        return 1 + len(scene.bodies)
    return 0 if shape.frame == GROUND_NAME else 1 + scene.bodies[shape.frame]


def _line(scene: Scene, shape: Shape) -> FloatArray:
    """Return the line (k, 2) of a shape."""
    if shape.kind == "block":
        half = _BLOCK * scene.size * shape.towards
        return np.array([shape.points[0] - half, shape.points[0] + half])
    if shape.kind == "shaft":
        pose, barrel = scene.frames[shape.frame][0], scene.frames[shape.frame.removesuffix("rod") + "barrel"][0]
        return np.array([[-float(np.hypot(*(pose - barrel)[:2])), 0.0], [0.0, 0.0]])
    return shape.line if shape.kind in ("link", "rib") else shape.extent


class _Brush:
    """Writer of URDF visuals; size: of the mechanism [length]; metres: length of its unit [m]; width: of links [m]."""

    def __init__(self, size: float, metres: float) -> None:
        self.width = _WIDTH * size * metres
        self._metres = metres

    def visuals(self, shape: Shape, layer: int, line: FloatArray) -> Iterator[str]:
        """Yield a shape as boxes along its line (k, 2) [length], and discs at the line's points."""
        paint = _PAINT[shape.kind]
        colour = palette.lighter(shape.colour) if shape.kind == "shaft" else shape.colour
        width, height = paint.width * self.width, (layer + paint.height) * self.width
        yield from self.bars(line, colour, width, height)
        if paint.has_discs:
            yield from self.discs(line, colour, width, height)

    def bars(self, points: FloatArray, colour: palette.Colour, width: float, height: float) -> Iterator[str]:
        """Yield boxes along a polyline (k, 2) [length]; width, height above the ground [m]."""
        for start, end in pairwise(self._metres * points):
            (x, y), (dx, dy) = (start + end) / 2, end - start
            if dx or dy:
                yield _visual(
                    f'xyz="{x:.9g} {y:.9g} {height:.9g}" rpy="0 0 {np.arctan2(dy, dx):.9g}"',
                    f'<box size="{np.hypot(dx, dy):.9g} {width:.9g} {width:.9g}"/>',
                    colour,
                )

    def discs(self, points: FloatArray, colour: palette.Colour, width: float, height: float) -> Iterator[str]:
        """Yield one disc on each of the points (k, 2) [length]."""
        for x, y in self._metres * distinct(points):
            yield _visual(
                f'xyz="{x:.9g} {y:.9g} {height:.9g}" rpy="0 0 0"',
                f'<cylinder radius="{width:.9g}" length="{1.2 * width:.9g}"/>',
                colour,
            )


def _visual(origin: str, shape: str, colour: palette.Colour) -> str:
    rgb = " ".join(f"{channel / 255:.3g}" for channel in colour)
    name = "".join(f"{channel:02x}" for channel in colour)
    material = f'<material name="{name}"><color rgba="{rgb} 1"/></material>'
    return f"<visual><origin {origin}/><geometry>{shape}</geometry>{material}</visual>"
