"""The scene of a run: shapes in frames with their poses, pins, points of interest with their paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant, directions, gravity_direction
from kinfmu.draw.scene.placing import poses_of, remedy, world
from kinfmu.draw.scene.shape import Shape, frames, pins_of
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.scene.strokes import UNITS, Sizes, fineness
from kinfmu.errors import MechanismError
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.run import Run

MOST_SAMPLES = 2000  # of a run, from which bounds and shapes are computed
_WITHOUT_POSE = ("link", "rib", "bar", "support")  # shapes that do not depend on a pose


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything to draw of one run, lengths in the mechanism's unit, y up.

    bodies: moving bodies whose pose is known, with their index in the file; frames: poses (n, 3) of x, y [length], phi
    [rad] by name, NaN where the run has no numbers; shapes: fixed in frames; pins: by frame, with the names of their
    joints, (2,); points: of interest, by frame, with their names, (2,); paths: (n, 2) of the points of interest, by
    name; left_out: bodies whose pose is not in the run -> the missing coordinates; low, high: corners (2,) of the
    bounding box; gravity: its direction (2,), None without gravity or masses.
    """

    bodies: Mapping[str, int]
    frames: Mapping[str, FloatArray]
    shapes: tuple[Shape, ...]
    pins: Mapping[str, Sequence[tuple[str, FloatArray]]]
    points: Mapping[str, Sequence[tuple[str, FloatArray]]]
    paths: Mapping[str, FloatArray]
    left_out: Mapping[str, tuple[str, ...]]
    low: FloatArray
    high: FloatArray
    gravity: FloatArray | None

    def colour(self, point: str) -> palette.Colour:
        """Return the colour of a point of interest."""
        return palette.body(len(self.bodies) + list(self.paths).index(point))

    @property
    def supports(self) -> dict[str, FloatArray]:
        """Pins of the ground, name -> (2,)."""
        return {shape.name: shape.points[0] for shape in self.shapes if shape.kind == "support"}

    @property
    def size(self) -> float:
        """Larger side of the bounding box; 1 if everything is one point."""
        return float(max(self.high - self.low)) or 1.0

    @cached_property
    def sizes(self) -> Sizes:
        """Sizes of strokes in a picture of the whole scene."""
        return Sizes(self.size / UNITS, fineness(self.shapes, self.size))


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
    bodies = {body.name: index for index, body in enumerate(mechanism.moving_bodies) if body.name in poses}
    known = poses | {GROUND_NAME: np.zeros((len(run), 3))}
    good = np.flatnonzero(run.good)
    rows = np.concatenate([good[:1], good[_some(len(good))]])
    placed = {name: pose[rows] if len(rows) else np.zeros((1, 3)) for name, pose in known.items()}
    shown = Instant(mechanism, placed, directions(run, mechanism))
    found = tuple(shape for shape in shapes(shown) if len(rows) or shape.kind in _WITHOUT_POSE)
    pins: dict[str, list[tuple[str, FloatArray]]] = {}
    for joint in mechanism.joints:
        for point in pins_of(joint):
            pins.setdefault(body_of(point), []).append((joint.name, shown.at(point)))
    for shape in found:
        if shape.kind in ("barrel", "shaft"):
            pins[shape.frame] = [(shape.name, np.zeros(2))]
        elif shape.is_effort and len(shape.points) > 1:
            for frame, point in zip((shape.frame, shape.other), shape.points, strict=True):
                pins.setdefault(frame, []).append((shape.name, point))
    points: dict[str, list[tuple[str, FloatArray]]] = {}
    for name, point in mechanism.points.items():
        points.setdefault(body_of(point), []).append((name, shown.at(point)))
    paths = {
        name: world(known[body_of(point)], mechanism.body_points[point])
        for name, point in mechanism.points.items()
        if body_of(point) in known
    }
    moved, corners, gravity = frames(known, mechanism), _bounds(found, known), gravity_direction(mechanism)
    return Scene(bodies, moved, found, pins, points, paths, left_out, *corners, gravity)


def _some(count: int) -> slice:
    """Return a slice of at most MOST_SAMPLES of `count` samples."""
    return slice(None, None, max(-(-count // MOST_SAMPLES), 1))


def _bounds(found: Sequence[Shape], poses: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the box around the shapes of all bodies and of the ground over the run."""
    corners = [np.empty((0, 2))]
    for shape in found:
        if shape.kind == "pitch":  # only figures draw it
            continue
        if shape.is_effort:  # its points on bodies are those of links
            ends = zip((shape.frame, shape.other), shape.points, strict=False)
            corners += [point[None] for frame, point in ends if frame == GROUND_NAME]
            continue
        if shape.frame == GROUND_NAME:
            corners.append(shape.extent)
        elif shape.frame in poses:
            pose = poses[shape.frame]
            pose = pose[np.isfinite(pose).all(axis=1)]
            corners += [world(pose[_some(len(pose))], (x, y)) for x, y in shape.extent]
    everything = np.vstack(corners)
    if not len(everything):
        everything = np.zeros((1, 2))
    return everything.min(axis=0), everything.max(axis=0)
