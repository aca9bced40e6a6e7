"""What of a run can be drawn: bodies as lines through their points, pins, supports, bars, guides and paths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from kinfmu.errors import MechanismError
from kinfmu.joints import Coordinate, Distance, Revolute
from kinfmu.joints.joint import Joint
from kinfmu.mechanism import toml_file
from kinfmu.mechanism.body import GROUND_NAME, Body
from kinfmu.mechanism.mechanism import COORDINATES, Mechanism
from kinfmu.run import FloatArray, Run

FLAT = 1e-6  # points nearer to one line than this part of their extent count as a line


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """A moving body: a line through its points in its own frame, and where the frame is.

    outline: polyline (k, 2); pose: (n, 3) of x, y [length], phi [rad], NaN where the run has no numbers; index: its
    place in the file, for the colour.
    """

    name: str
    index: int
    outline: FloatArray
    pose: FloatArray


@dataclass(frozen=True, eq=False)
class DrawnBar:
    """A massless bar between two points (joint Distance): ends (n, 2, 2) in the world [length]."""

    name: str
    length: float
    ends: FloatArray


@dataclass(frozen=True)
class DrawnGuide:
    """A line parallel to an axis on which a point slides (joint Coordinate): axis 'x' means x = value [length]."""

    name: str
    axis: str
    value: float


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything to draw of one run, lengths in the mechanism's unit, y up.

    supports: pins of the ground, name -> (x, y); pins: (n, p, 2), where joints hold bodies; paths: (n, 2) of the
    points of interest, by name; left_out: bodies whose pose the run does not hold -> the missing coordinates; low,
    high: corners (2,) of the box around everything.
    """

    bodies: tuple[DrawnBody, ...]
    bars: tuple[DrawnBar, ...]
    guides: tuple[DrawnGuide, ...]
    supports: Mapping[str, tuple[float, float]]
    pins: FloatArray
    paths: Mapping[str, FloatArray]
    left_out: Mapping[str, tuple[str, ...]]
    low: FloatArray
    high: FloatArray

    @property
    def size(self) -> float:
        """Larger side of the bounding box, the measure for line widths; 1 when everything is one point."""
        return float(max(self.high - self.low)) or 1.0


def drawable(run: Run) -> tuple[Scene | None, str]:
    """The scene of a run after its own mechanism text, and one sentence on what cannot be drawn, empty if nothing."""
    if not run.mechanism_text:
        return None, "Not drawn: the run does not hold its mechanism."
    try:
        found = scene(run, toml_file.parse(run.mechanism_text, "the run's mechanism"))
    except MechanismError as error:
        return None, f"Not drawn: {error}"
    parts = [f"{body} (the run does not hold {', '.join(names)})" for body, names in found.left_out.items()]
    return found, f"Not drawn: {'; '.join(parts)}." if parts else ""


def scene(run: Run, mechanism: Mechanism) -> Scene:
    """The drawable part of `run`."""
    poses, left_out = _poses(run, mechanism)
    points = mechanism.body_points
    used = {text for joint in mechanism.joints for text in _texts(joint)}

    def track(point: str) -> FloatArray | None:
        body = point.partition(".")[0]
        if body == GROUND_NAME:
            return np.tile(np.array(points[point]), (len(run), 1))
        return world(poses[body], points[point]) if body in poses else None

    bodies = tuple(
        DrawnBody(body.name, index, outline(_coordinates(body)), poses[body.name])
        for index, body in enumerate(mechanism.moving_bodies)
        if body.name in poses
    )
    bars, guides = [], []
    for joint in mechanism.joints:
        if isinstance(joint, Distance):
            ends = [track(point) for point in joint.between]
            if ends[0] is not None and ends[1] is not None:
                bars.append(DrawnBar(joint.name, joint.length, np.stack([ends[0], ends[1]], axis=1)))
        elif isinstance(joint, Coordinate):
            guides.append(DrawnGuide(joint.name, joint.axis, joint.value))
    paths = {name: path for name, point in mechanism.points.items() if (path := track(point)) is not None}
    supports = {
        name.partition(".")[2]: (point[0], point[1])
        for name, point in points.items()
        if name in used and name.startswith(f"{GROUND_NAME}.")
    }
    pins = [pin for joint in mechanism.joints for point in _pins_of(joint, points) if (pin := track(point)) is not None]
    return Scene(
        bodies,
        tuple(bars),
        tuple(guides),
        supports,
        np.stack(pins, axis=1) if pins else np.empty((len(run), 0, 2)),
        paths,
        left_out,
        *_bounds(mechanism, poses, supports),
    )


def world(pose: FloatArray, s: tuple[float, float]) -> FloatArray:
    """World coordinates r + A s, (n, 2), of the body-fixed point s under poses (n, 3)."""
    x, y, phi = pose.T
    c, sin = np.cos(phi), np.sin(phi)
    return np.column_stack([x + c * s[0] - sin * s[1], y + sin * s[0] + c * s[1]])


def outline(points: FloatArray) -> FloatArray:
    """A polyline (k, 2) that makes a link out of its points (p, 2): along them, or around them and to those inside."""
    points = np.unique(points, axis=0)
    if len(points) < 3:
        return points
    centred = points - points.mean(axis=0)
    _, extents, directions = np.linalg.svd(centred, full_matrices=False)
    if extents[1] <= FLAT * extents[0]:
        return points[np.argsort(centred @ directions[0])]
    hull = _hull(points)
    rim, inside = points[hull], np.delete(points, hull, axis=0)
    nearest = [int(np.argmin(np.hypot(*(rim - point).T))) for point in inside]
    route = []
    for k, corner in enumerate(rim):
        route.append(corner)
        for point, home in zip(inside, nearest, strict=True):
            if home == k:
                route += [point, corner]  # a spoke, there and back
    return np.array([*route, rim[0]])


def _hull(points: FloatArray) -> list[int]:
    """Indices of the convex hull of points sorted by x then y, counter-clockwise (Andrew's monotone chain)."""

    def chain(order: range) -> list[int]:
        kept: list[int] = []
        for index in order:
            while len(kept) > 1:
                (a_x, a_y), (b_x, b_y) = points[kept[-1]] - points[kept[-2]], points[index] - points[kept[-2]]
                if a_x * b_y - a_y * b_x > 0.0:
                    break
                kept.pop()
            kept.append(index)
        return kept[:-1]

    return chain(range(len(points))) + chain(range(len(points) - 1, -1, -1))


def _poses(run: Run, mechanism: Mechanism) -> tuple[dict[str, FloatArray], dict[str, tuple[str, ...]]]:
    """Pose (n, 3) by body, and for each body that cannot be drawn the coordinates that are missing."""
    columns = {name: run.values[:, k] for k, name in enumerate(run.outputs)}
    columns |= {name: np.full(len(run), value) for name, value in run.fixed.items()}
    poses, left_out = {}, {}
    for body in mechanism.moving_bodies:
        names = [f"{body.name}.{coordinate}" for coordinate in COORDINATES]
        missing = tuple(name for name in names if name not in columns)
        if missing:
            left_out[body.name] = missing
        else:
            pose = np.column_stack([columns[name] for name in names])
            known = run.good & np.isfinite(pose).all(axis=1)
            poses[body.name] = np.where(known[:, None], pose, np.nan)
    return poses, left_out


def _pins_of(joint: Joint, points: Mapping[str, object]) -> list[str]:
    """Points 'body.point' where a joint is drawn; those of a revolute joint coincide."""
    named = [text for text in _texts(joint) if text in points]
    return named[:1] if isinstance(joint, Revolute) else named


def _texts(joint: Joint) -> list[str]:
    found: list[str] = []
    for key in fields(joint):  # type: ignore[arg-type]  # every leaf is a dataclass; the contract cannot say so
        value = getattr(joint, key.name)
        found += [one for one in (value if isinstance(value, tuple) else (value,)) if isinstance(one, str)]
    return found


def _coordinates(body: Body) -> FloatArray:
    """Body-fixed points (p, 2), the frame's origin for a body that names none."""
    return np.array([tuple(point) for point in body.points.values()] or [(0.0, 0.0)])


def _bounds(
    mechanism: Mechanism, poses: Mapping[str, FloatArray], supports: Mapping[str, tuple[float, float]]
) -> tuple[FloatArray, FloatArray]:
    """Corners of the box around the supports and all points of all bodies over the run."""
    corners = [np.array(list(supports.values()), dtype=float).reshape(-1, 2)]
    for body in mechanism.moving_bodies:
        if body.name in poses:
            pose = poses[body.name]
            pose = pose[np.isfinite(pose).all(axis=1)]
            corners += [world(pose, (x, y)) for x, y in _coordinates(body)]
    everything = np.vstack(corners)
    if not len(everything):
        everything = np.zeros((1, 2))
    return everything.min(axis=0), everything.max(axis=0)
