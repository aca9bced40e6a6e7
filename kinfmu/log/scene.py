"""What of a run can be drawn: bodies as lines through their points, pins, supports, bars, guides and paths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kinfmu.errors import MechanismError
from kinfmu.joints import Coordinate, Distance
from kinfmu.mechanism import toml_file
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.shapes.outline import outline, points_of
from kinfmu.shapes.pins import names_in, pins_of
from kinfmu.shapes.placing import poses_of, world


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
    poses, left_out = poses_of(run, mechanism)
    points = mechanism.body_points
    used = {text for joint in mechanism.joints for text in names_in(joint)}

    def track(point: str) -> FloatArray | None:
        body = point.partition(".")[0]
        if body == GROUND_NAME:
            return np.tile(np.array(points[point]), (len(run), 1))
        return world(poses[body], points[point]) if body in poses else None

    bodies = tuple(
        DrawnBody(body.name, index, outline(points_of(body)), poses[body.name])
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
    pins = [pin for joint in mechanism.joints for point in pins_of(joint, points) if (pin := track(point)) is not None]
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


def _bounds(
    mechanism: Mechanism, poses: Mapping[str, FloatArray], supports: Mapping[str, tuple[float, float]]
) -> tuple[FloatArray, FloatArray]:
    """Corners of the box around the supports and all points of all bodies over the run."""
    corners = [np.array(list(supports.values()), dtype=float).reshape(-1, 2)]
    for body in mechanism.moving_bodies:
        if body.name in poses:
            pose = poses[body.name]
            pose = pose[np.isfinite(pose).all(axis=1)]
            corners += [world(pose, (x, y)) for x, y in points_of(body)]
    everything = np.vstack(corners)
    if not len(everything):
        everything = np.zeros((1, 2))
    return everything.min(axis=0), everything.max(axis=0)
