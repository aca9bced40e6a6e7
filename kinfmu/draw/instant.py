"""The instant that a figure shows: where everything is at the start pose, and where the run takes it from there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kinfmu.equations.assembly import CLOSED, assemble, close, rough_start, start_targets
from kinfmu.equations.system import System
from kinfmu.errors import KinfmuError
from kinfmu.joints import Placement, Pose
from kinfmu.joints.placement import body_of
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.run import FloatArray
from kinfmu.shapes.placing import poses_of, world
from kinfmu.sweep import run_times, solve

MOST_SAMPLES = 1000  # of the run; a figure shows no more


@dataclass(frozen=True, eq=False)
class Instant:
    """The start pose, closed, and the poses of the run.

    poses: (1 + n, 3) by body, the ground too: x, y [length], phi [rad] at the start pose, then at n samples of the run,
    NaN where one holds no numbers. ways: +1.0 or -1.0 by driver, which way it moves first.
    """

    mechanism: Mechanism
    poses: Mapping[str, FloatArray]
    ways: Mapping[str, float]

    def track(self, point: str) -> FloatArray:
        """World coordinates (1 + n, 2) of 'body.point', the first at the start pose."""
        return world(self.poses[body_of(point)], self.mechanism.body_points[point])

    def point(self, point: str) -> FloatArray:
        """World coordinates (2,) of 'body.point' at the start pose."""
        return np.asarray(self.track(point)[0])

    def placed(self, body: str, points: FloatArray) -> FloatArray:
        """World coordinates (k, 2) at the start pose of points (k, 2) in a body's frame."""
        return np.array([world(self.poses[body][:1], (x, y))[0] for x, y in points]).reshape(-1, 2)

    def angle(self, body: str) -> float:
        """Angle of a body at the start pose [rad]."""
        return float(self.poses[body][0, 2])

    def value(self, driver: str) -> float:
        """What a driver measures at the start pose [rad or length]."""
        poses = {name: Pose.of(*pose[0].tolist()) for name, pose in self.poses.items()}
        (found,) = (one for one in self.mechanism.drivers if one.name == driver)
        return float(found.measured().value(Placement(poses, self.mechanism.body_points)))


def instant(mechanism: Mechanism) -> Instant:
    """The start pose and the run of a mechanism.

    One that cannot be solved, for want of a driver say, is shown at the start pose without its run. One that does not
    close raises the error that says so.
    """
    try:
        plan = compile_plan(replace(mechanism, coordinates="all"))
    except KinfmuError as problem:
        return _standing(mechanism, problem)
    return _moving(mechanism, plan)


def _moving(mechanism: Mechanism, plan: SolvePlan) -> Instant:
    times = run_times(mechanism.run)
    run = solve(plan, times[:: -(-len(times) // MOST_SAMPLES)])
    poses, _ = poses_of(run, mechanism)
    start = _by_body(mechanism, plan.anchor.q, plan.origin)
    ways = {}
    for k, driver in enumerate(mechanism.drivers):
        speeds = run.inputs[:, 3 * k + 1]
        moving = speeds[speeds != 0.0]
        ways[driver.name] = float(np.sign(moving[0])) if len(moving) else 1.0
    motion = {name: np.vstack([pose, poses[name]]) for name, pose in start.items()}
    return Instant(mechanism, motion | {GROUND_NAME: np.zeros((1 + len(run), 3))}, ways)


def _standing(mechanism: Mechanism, problem: KinfmuError) -> Instant:
    """The start pose alone, of all rows or, where drivers contradict, of the joints."""
    local, origin = localized(mechanism)
    system = System(local)
    assembled = assemble(system)
    if assembled is not None:
        q = assembled.q
    else:
        q, gap = close(system, rough_start(system), start_targets(system), range(system.joint_row_count))
        if gap > CLOSED:
            raise problem
    poses = _by_body(mechanism, q, origin)
    return Instant(
        mechanism, poses | {GROUND_NAME: np.zeros((1, 3))}, {driver.name: 1.0 for driver in mechanism.drivers}
    )


def _by_body(mechanism: Mechanism, q: FloatArray, origin: Point) -> dict[str, FloatArray]:
    """Pose (1, 3) by moving body from all coordinates q, which count from `origin`."""
    poses = q.reshape(-1, 3) + np.array([origin.x, origin.y, 0.0])
    return {body.name: pose[None] for body, pose in zip(mechanism.moving_bodies, poses, strict=True)}
