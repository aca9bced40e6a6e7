"""One instant of a motion: the pose to draw, and the poses of the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.placing import seen_from, world
from kinfmu.draw.scene.shape import frames
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Revolute
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.quantities.placement import BodyFrame, Placement, body_of
from kinfmu.run import Run


class OpenGap(NamedTuple):
    """The joint at which a mechanism does not close in the drawn pose, and its gap such as 'gap 7.5 mm'."""

    joint: str
    text: str


@dataclass(frozen=True, eq=False)
class Instant:
    """The pose to draw, and the poses of the run.

    poses: (1 + n, 3) by body, ground included: x, y [length], phi [rad] of the drawn pose, then of n samples of the
    run, NaN at samples without numbers. Bodies whose pose is not in the run are missing, and so are their joints.
    directions: +1.0 or -1.0 by driver, the direction of its first motion. open_gap: where the mechanism does not close.
    is_clearest: the pose is drawn because links hide one another least in it.
    """

    mechanism: Mechanism
    poses: Mapping[str, FloatArray]
    directions: Mapping[str, float]
    open_gap: OpenGap | None = None
    is_clearest: bool = False

    @property
    def joints(self) -> Sequence[Joint]:
        """Joints between bodies whose poses are known."""
        return [joint for joint in self.mechanism.joints if self.poses.keys() >= set(joint.bodies())]

    @property
    def drivers(self) -> Sequence[Driver]:
        """Drivers of bodies whose poses are known."""
        return [driver for driver in self.mechanism.drivers if self.poses.keys() >= set(driver.bodies())]

    @cached_property
    def body_points(self) -> Mapping[str, tuple[float, float]]:
        """Body-fixed coordinates of every point, by 'body.point'."""
        return self.mechanism.body_points

    @cached_property
    def frames(self) -> Mapping[str, FloatArray]:
        """Poses (1 + n, 3) of all frames that move shapes, by name."""
        return frames(self.poses, self.mechanism)

    def track(self, point: str) -> FloatArray:
        """Return world coordinates (1 + n, 2) of 'body.point', first as drawn."""
        return world(self.poses[body_of(point)], self.body_points[point])

    def point(self, point: str) -> FloatArray:
        """Return world coordinates (2,) of 'body.point' as drawn."""
        return np.asarray(world(self.poses[body_of(point)][:1], self.body_points[point])[0])

    def at(self, point: str) -> FloatArray:
        """Return body-fixed coordinates (2,) of 'body.point'."""
        return np.array(self.body_points[point])

    def placed(self, frame: str, points: FloatArray) -> FloatArray:
        """Return world coordinates (k, 2) as drawn of points (k, 2) in a frame."""
        x, y = np.reshape(points, (-1, 2)).T
        return world(self.frames[frame][:1], (x, y))

    def seen(self, frame: str, points: FloatArray) -> FloatArray:
        """Return coordinates (k, 2) in a frame of points (k, 2) of the world, the inverse of `placed`."""
        return seen_from(np.tile(self.frames[frame][:1], (len(points), 1)), points)

    def angle(self, body: str) -> float:
        """Return the angle of a body as drawn [rad]."""
        return float(self.poses[body][0, 2])

    def colour(self, body: str) -> palette.Colour:
        """Return the colour of a body or of the ground."""
        order = [moving.name for moving in self.mechanism.moving_bodies]
        return palette.body(order.index(body)) if body in order else palette.GROUND

    def axle(self, wheel: str, carrier: str) -> FloatArray | None:
        """Return the place of the pin between a wheel and its carrier, (2,); None if there is none."""
        for joint in self.joints:
            if isinstance(joint, Revolute) and set(joint.bodies()) == {wheel, carrier}:
                return self.point(joint.between[0])
        return None

    def pivot(self, body: str, against: str) -> str | None:
        """Return the point 'body.point' of a body at its pin, first that to another body; None without a pin."""
        pins = [joint for joint in self.joints if isinstance(joint, Revolute) and body in joint.bodies()]
        for joint in sorted(pins, key=lambda joint: against not in joint.bodies()):
            return next(point for point in joint.between if body_of(point) == body)
        return None

    def value(self, driver: str) -> float:
        """Return the value of a driver as drawn [rad or length]."""
        poses = {name: BodyFrame.of(*pose[0].tolist()) for name, pose in self.poses.items()}
        (found,) = (one for one in self.mechanism.drivers if one.name == driver)
        return float(found.measured().value(Placement(poses, self.body_points)))


def directions(run: Run, mechanism: Mechanism) -> dict[str, float]:
    """Return +1.0 or -1.0 by driver, the direction of its first motion in a run."""
    found = {}
    for driver in mechanism.drivers:
        _, speed, _ = driver.inputs()
        is_known = speed in run.input_names and speed not in run.absent
        moving = run[speed][run[speed] != 0.0] if is_known else np.zeros(0)
        found[driver.name] = float(np.sign(moving[0])) if len(moving) and np.isfinite(moving[0]) else 1.0
    return found


def gravity_direction(mechanism: Mechanism) -> FloatArray | None:
    """Return the unit vector (2,) of gravity in the world; None without gravity or without bodies with masses."""
    pull = np.array(mechanism.gravity or (0.0, 0.0), dtype=float)
    if not pull.any() or not any(body.mass for body in mechanism.moving_bodies):
        return None
    return np.asarray(pull / np.hypot(*pull))
