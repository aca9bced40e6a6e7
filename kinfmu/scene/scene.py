"""The scene of a run: bodies as lines in their own frames, pins, supports, rails, bars, cylinders and paths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.errors import MechanismError
from kinfmu.joints import Distance, Fixed, Revolute
from kinfmu.measures.placement import body_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.scene.completing import remedy
from kinfmu.scene.cylinders import CylinderShape, cylinder_shapes
from kinfmu.scene.instant import Instant
from kinfmu.scene.outline import outline, pins_of, points_of, supported
from kinfmu.scene.placing import poses_of, world
from kinfmu.scene.strokes import Stroke, strokes

MOST_SAMPLES = 2000  # of a run, from which bounds and shapes are computed
_LONG_ENOUGH, _FINEST = 0.15, 0.1  # of the size: shortest link that needs no thinner lines; factor of the thinnest


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """A moving body: lines in its own frame, and poses of the frame.

    outline: polyline (k, 2) through its points; strokes: lines that joints add, such as a cam's profile or a slot;
    pins: by joint, (2,); points: of interest, by name; pose: (n, 3) of x, y [length], phi [rad], NaN where the run has
    no numbers; index: of the body in the file, which chooses the colour.
    """

    name: str
    index: int
    outline: FloatArray
    strokes: tuple[Stroke, ...]
    pins: tuple[tuple[str, FloatArray], ...]
    points: Mapping[str, FloatArray]
    pose: FloatArray


@dataclass(frozen=True, eq=False)
class DrawnBar:
    """A massless bar between two points (joint Distance): ends (n, 2, 2) in the world [length]."""

    name: str
    length: float
    ends: FloatArray


@dataclass(frozen=True, eq=False)
class DrawnCylinder:
    """A driven distance: its barrel and rod, ends (n, 2, 2) in the world [length]."""

    shape: CylinderShape
    ends: FloatArray


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything to draw of one run, lengths in the mechanism's unit, y up.

    supports: pins of the ground, name -> (x, y); ground: rails and other fixed lines; pins: of the ground, by joint,
    (2,); paths: (n, 2) of the points of interest, by name; left_out: bodies whose pose is not in the run -> the missing
    coordinates; low, high: corners (2,) of the bounding box.
    """

    bodies: tuple[DrawnBody, ...]
    bars: tuple[DrawnBar, ...]
    cylinders: tuple[DrawnCylinder, ...]
    ground: tuple[Stroke, ...]
    supports: Mapping[str, tuple[float, float]]
    pins: tuple[tuple[str, FloatArray], ...]
    paths: Mapping[str, FloatArray]
    left_out: Mapping[str, tuple[str, ...]]
    low: FloatArray
    high: FloatArray

    @property
    def size(self) -> float:
        """Larger side of the bounding box; 1 if everything is one point."""
        return float(max(self.high - self.low)) or 1.0

    @property
    def stroke(self) -> float:
        """Reference length of line widths: the size, or less if links are short compared with it."""
        lengths = [bar.length for bar in self.bars]
        for body in self.bodies:
            lengths += np.hypot(*np.diff(body.outline, axis=0).T).tolist()
        shortest = min((length for length in lengths if length > 1e-3 * self.size), default=self.size)
        return self.size * math.sqrt(min(max(shortest / (_LONG_ENOUGH * self.size), _FINEST**2), 1.0))


def drawable(run: Run) -> tuple[Scene | None, str]:
    """Return the scene of a run, None if there is none, and a sentence on what cannot be drawn, '' if all is drawn."""
    try:
        if run.mechanism is None:
            return None, "Not drawn: the run does not hold its mechanism."
        found = scene(run, run.mechanism)
    except MechanismError as error:
        return None, f"Not drawn: {error}"
    parts = [f"{body} (the run does not hold {', '.join(names)})" for body, names in found.left_out.items()]
    advice = remedy(run, [name for names in found.left_out.values() for name in names])
    return found, f"Not drawn: {'; '.join(parts)}; {advice}." if parts else ""


def scene(run: Run, mechanism: Mechanism) -> Scene:
    """Return the scene of `run`, without bodies whose poses are unknown."""
    poses, left_out = poses_of(run, mechanism)
    points = mechanism.body_points
    shown = _instant(run, mechanism, poses)
    added = strokes(shown) if shown else {}
    cylinders = cylinder_shapes(shown) if shown else []

    def track(point: str) -> FloatArray | None:
        body = body_of(point)
        if body == GROUND_NAME:
            return np.tile(np.array(points[point]), (len(run), 1))
        return world(poses[body], points[point]) if body in poses else None

    def ends_of(between: tuple[str, str]) -> FloatArray | None:
        a, b = map(track, between)
        return None if a is None or b is None else np.stack([a, b], axis=1)

    pins = _pins(mechanism)
    bodies = tuple(
        DrawnBody(
            body.name,
            index,
            outline(points_of(body)),
            tuple(added.get(body.name, ())),
            tuple(pins.get(body.name, ())),
            {name: np.array(points[p]) for name, p in mechanism.points.items() if body_of(p) == body.name},
            poses[body.name],
        )
        for index, body in enumerate(mechanism.moving_bodies)
        if body.name in poses
    )
    bars = tuple(
        DrawnBar(joint.name, joint.length, ends)
        for joint in mechanism.joints
        if isinstance(joint, Distance) and (ends := ends_of(joint.between)) is not None
    )
    driven = tuple(DrawnCylinder(shape, ends) for shape in cylinders if (ends := ends_of(shape.between)) is not None)
    supports = _supports(mechanism, cylinders)
    ground = tuple(added.get(GROUND_NAME, ()))
    return Scene(
        bodies,
        bars,
        driven,
        ground,
        supports,
        tuple(pins.get(GROUND_NAME, ())),
        {name: path for name, point in mechanism.points.items() if (path := track(point)) is not None},
        left_out,
        *_bounds(bodies, ground, supports),
    )


def _pins(mechanism: Mechanism) -> dict[str, list[tuple[str, FloatArray]]]:
    """Return pins by body, in its frame, each with the name of its joint."""
    points = mechanism.body_points
    pins: dict[str, list[tuple[str, FloatArray]]] = {}
    for joint in mechanism.joints:
        for name in pins_of(joint):
            pins.setdefault(body_of(name), []).append((joint.name, np.array(points[name])))
    return pins


def _supports(mechanism: Mechanism, cylinders: Sequence[CylinderShape]) -> dict[str, tuple[float, float]]:
    """Return points of the ground that hold joints or cylinders, by name.

    The names are those of the revolute joints and welds there, else of the points, as in figures.
    """
    joints: dict[str, list[str]] = {end: [] for cylinder in cylinders for end in cylinder.between}
    for joint in mechanism.joints:
        for name in supported(joint):
            joints.setdefault(name, []).extend([joint.name] if isinstance(joint, Revolute | Fixed) else [])
    at: dict[tuple[float, float], list[str]] = {}
    for name, place in mechanism.body_points.items():
        if name in joints and body_of(name) == GROUND_NAME:
            at.setdefault(place, []).extend(joints[name] or [name.partition(".")[2]])
    return {", ".join(dict.fromkeys(names)): place for place, names in at.items()}


def _instant(run: Run, mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> Instant | None:
    """Return the first sample with numbers, and some of the others; None if there is none."""
    good = np.flatnonzero(run.good)
    if not len(good):
        return None
    rows = np.concatenate([good[:1], good[_some(len(good))]])
    placed = {name: pose[rows] for name, pose in poses.items()} | {GROUND_NAME: np.zeros((len(rows), 3))}
    return Instant(mechanism, placed, {driver.name: 1.0 for driver in mechanism.drivers})


def _some(count: int) -> slice:
    """Return a slice of at most MOST_SAMPLES of `count` samples."""
    return slice(None, None, max(-(-count // MOST_SAMPLES), 1))


def _bounds(
    bodies: tuple[DrawnBody, ...], ground: tuple[Stroke, ...], supports: Mapping[str, tuple[float, float]]
) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the box around the ground and all lines of all bodies over the run."""
    corners = [np.array(list(supports.values()), dtype=float).reshape(-1, 2), *(stroke.points for stroke in ground)]
    for body in bodies:
        pose = body.pose[np.isfinite(body.pose).all(axis=1)]
        pose = pose[_some(len(pose))]
        for points in (body.outline, *(stroke.extent for stroke in body.strokes)):
            corners += [world(pose, (x, y)) for x, y in points]
    everything = np.vstack(corners)
    if not len(everything):
        everything = np.zeros((1, 2))
    return everything.min(axis=0), everything.max(axis=0)
