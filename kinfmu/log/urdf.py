"""Robot description of a record: links of simple shapes as URDF, and the poses of their frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from xml.sax.saxutils import quoteattr

import numpy as np

from kinfmu.drivers import DistanceDriver
from kinfmu.joints import Distance
from kinfmu.measures.placement import body_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.scene import palette
from kinfmu.scene.placing import poses_of, world
from kinfmu.scene.scene import DrawnCylinder, Scene
from kinfmu.scene.strokes import Stroke

ROOT = "ground"  # the root frame
KNOWN_AT_ONCE = ("cam", "roller", "wheel", "spoke", "belt", "block")  # strokes whose size follows from one pose
_BAR, _BARREL, _ROD, _BLOCK = 0.02, 1.4, 0.6, 1.8  # width of links relative to the size; of others relative to links


def frames(run: Run, mechanism: Mechanism) -> dict[str, FloatArray]:
    """Return poses (n, 3) of x, y [length], phi [rad] of every link of the description: bodies, bars, cylinders."""
    poses, _ = poses_of(run, mechanism)
    placed = {body.name: poses[body.name] for body in mechanism.moving_bodies if body.name in poses}
    points = mechanism.body_points
    for member in (*mechanism.joints, *mechanism.drivers):
        if not isinstance(member, Distance | DistanceDriver):
            continue
        bodies = [body_of(point) for point in member.between]
        if not all(body in poses or body == GROUND_NAME for body in bodies):
            continue
        a, b = (
            np.broadcast_to(points[point], (len(run), 2)) if body == GROUND_NAME else world(poses[body], points[point])
            for body, point in zip(bodies, member.between, strict=True)
        )
        angle = np.arctan2(b[:, 1] - a[:, 1], b[:, 0] - a[:, 0])
        if isinstance(member, Distance):
            placed[_bar_frame(member.name)] = np.column_stack([a, angle])
        else:
            barrel, rod = _cylinder_frames(member.name)
            placed |= {barrel: np.column_stack([a, angle]), rod: np.column_stack([b, angle])}
    return placed


def robot_description(name: str, scene: Scene, metres: float) -> str:
    """Return the URDF of the scene; a floating joint connects each link to ROOT, since closed loops are not a tree.

    metres: length of the mechanism's unit [m]. Each link has its own layer, so that none hides another. Of what joints
    add to links only KNOWN_AT_ONCE is drawn, whose size follows from one pose: a record that grows does not know the
    later poses. For the same reason a cylinder's rod is as long as the cylinder is in that pose.
    """
    brush = _Brush(scene.size, metres)
    width = brush.width
    supports = brush.discs(np.array(list(scene.supports.values())).reshape(-1, 2), palette.GROUND, width, 0.0)
    links = {ROOT: [*supports, *_added(brush, scene.ground, palette.GROUND, 0.0)]}
    for body in scene.bodies:
        colour, height = palette.body(body.index), width * (1 + body.index)
        links[body.name] = [
            *brush.bars(body.outline, colour, width, height),
            *brush.discs(body.outline, colour, width, height),
            *_added(brush, body.strokes, colour, height),
        ]
    for bar in scene.bars:
        ends = np.array([[0.0, 0.0], [bar.length, 0.0]])
        links[_bar_frame(bar.name)] = [
            *brush.bars(ends, palette.BAR, 0.6 * width, -width),
            *brush.discs(ends, palette.BAR, 0.6 * width, -width),
        ]
    for cylinder in scene.cylinders:
        links |= _cylinder(brush, cylinder, width * (1 + len(scene.bodies)))
    lines = [f"<link name={quoteattr(link)}>{''.join(visuals)}</link>" for link, visuals in links.items()]
    lines += [
        f'<joint name={quoteattr(link + "_floats")} type="floating">'
        f"<parent link={quoteattr(ROOT)}/><child link={quoteattr(link)}/></joint>"
        for link in links
        if link != ROOT
    ]
    body_lines = "\n".join(lines)
    return f'<?xml version="1.0"?>\n<robot name={quoteattr(name)}>\n{body_lines}\n</robot>\n'


def _bar_frame(joint: str) -> str:
    return f"bar.{joint}"  # names of bodies hold no dot


def _cylinder_frames(driver: str) -> tuple[str, str]:
    """Return the frames of the barrel and of the rod."""
    return f"cylinder.{driver}.barrel", f"cylinder.{driver}.rod"


def _cylinder(brush: _Brush, cylinder: DrawnCylinder, height: float) -> dict[str, list[str]]:
    """Return the links of the barrel and of the rod; each begins at its own pin."""
    barrel, rod = _cylinder_frames(cylinder.shape.driver)
    length = float(np.hypot(*(cylinder.ends[0, 1] - cylinder.ends[0, 0])))
    tube, shaft = np.array([[0.0, 0.0], [cylinder.shape.barrel, 0.0]]), np.array([[-length, 0.0], [0.0, 0.0]])
    return {
        barrel: [*brush.bars(tube, palette.GROUND, _BARREL * brush.width, height)],
        rod: [*brush.bars(shaft, palette.lighter(palette.BAR), _ROD * brush.width, height)],
    }


def _added(brush: _Brush, strokes: Iterable[Stroke], own: palette.Colour, height: float) -> Iterator[str]:
    """Yield what joints add to a body, of KNOWN_AT_ONCE; blocks above the links, the rest below them."""
    for stroke in strokes:
        kind = stroke.name.partition("/")[0]
        if kind not in KNOWN_AT_ONCE:
            continue
        colour = palette.GROUND if stroke.tone == "grey" else own
        if kind == "block":
            yield from brush.bars(stroke.points, colour, _BLOCK * brush.width, height)
        else:
            yield from brush.bars(stroke.extent, colour, 0.4 * brush.width, height - 0.3 * brush.width)


class _Brush:
    """Writer of URDF visuals; size: of the mechanism [length]; metres: length of its unit [m]; width: of links [m]."""

    def __init__(self, size: float, metres: float) -> None:
        self.width = _BAR * size * metres
        self._metres = metres

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
        for x, y in self._metres * np.unique(points, axis=0):
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
