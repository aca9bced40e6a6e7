"""The instant that a figure shows: where everything is then, and where the run takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from kinfmu.draw.view import clearest
from kinfmu.equations.assembly import CLOSED, assemble, close, rough_start, start_targets
from kinfmu.equations.part import Part
from kinfmu.equations.system import System
from kinfmu.errors import KinfmuError
from kinfmu.joints import Placement, Pose, Revolute
from kinfmu.joints.placement import body_of
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.run import FloatArray
from kinfmu.shapes import palette
from kinfmu.shapes.placing import poses_of, world
from kinfmu.sweep import run_times, solve

MOST_SAMPLES = 1000  # of the run; a figure shows no more
_BESIDE = 0.1  # part of a driver's way; a start pose further from the run is a rough guess


@dataclass(frozen=True, eq=False)
class Instant:
    """The pose to draw, and the poses of the run.

    poses: (1 + n, 3) by body, the ground too: x, y [length], phi [rad] of the drawn pose, then at n samples of the run,
    NaN where one holds no numbers. ways: +1.0 or -1.0 by driver, which way it moves first.
    """

    mechanism: Mechanism
    poses: Mapping[str, FloatArray]
    ways: Mapping[str, float]

    @cached_property
    def body_points(self) -> Mapping[str, tuple[float, float]]:
        """Body-fixed coordinates of every point, by 'body.point'."""
        return self.mechanism.body_points

    def track(self, point: str) -> FloatArray:
        """World coordinates (1 + n, 2) of 'body.point', the first as drawn."""
        return world(self.poses[body_of(point)], self.body_points[point])

    def point(self, point: str) -> FloatArray:
        """World coordinates (2,) of 'body.point' as drawn."""
        return np.asarray(world(self.poses[body_of(point)][:1], self.body_points[point])[0])

    def placed(self, body: str, points: FloatArray) -> FloatArray:
        """World coordinates (k, 2) of points (k, 2) in a body's frame, as drawn."""
        return np.array([world(self.poses[body][:1], (x, y))[0] for x, y in points]).reshape(-1, 2)

    def angle(self, body: str) -> float:
        """Angle of a body as drawn [rad]."""
        return float(self.poses[body][0, 2])

    def colour(self, body: str) -> palette.Colour:
        """Colour of a body, the ground's too."""
        order = [moving.name for moving in self.mechanism.moving_bodies]
        return palette.body(order.index(body)) if body in order else palette.GROUND

    def axle(self, wheel: str, carrier: str) -> FloatArray | None:
        """Where a pin holds a wheel on its carrier, (2,); None if none does."""
        for joint in self.mechanism.joints:
            if isinstance(joint, Revolute) and set(joint.bodies()) == {wheel, carrier}:
                return self.point(joint.between[0])
        return None

    def value(self, driver: str) -> float:
        """What a driver measures as drawn [rad or length]."""
        poses = {name: Pose.of(*pose[0].tolist()) for name, pose in self.poses.items()}
        (found,) = (one for one in self.mechanism.drivers if one.name == driver)
        return float(found.measured().value(Placement(poses, self.body_points)))


def instant(mechanism: Mechanism) -> Instant:
    """What to draw of a mechanism: its start pose, if the run comes by it and links do not lie on one another there.

    Else a sample of the run in which they do not. A mechanism that cannot be solved, for want of a driver say, is shown
    at the start pose without its run. One that does not close raises the error that says so.
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
    poses[GROUND_NAME] = np.zeros((len(run), 3))
    start = _by_body(mechanism, plan.anchor.q, plan.origin)
    values = run.inputs[:, ::3]  # (n, d)
    is_met = not run.good.any() or _is_near(plan.anchor.u, values[run.good])
    choice = {name: np.vstack([start[name], pose]) if is_met else pose for name, pose in poses.items()}
    row = clearest(mechanism, choice)
    ways = {}
    for k, driver in enumerate(mechanism.drivers):
        speeds = run.inputs[:, 3 * k + 1]
        moving = speeds[speeds != 0.0]
        ways[driver.name] = float(np.sign(moving[0])) if len(moving) else 1.0
    drawn = {name: np.vstack([choice[name][row], pose]) for name, pose in poses.items()}
    return Instant(mechanism, drawn, ways)


def _is_near(u: FloatArray, values: FloatArray) -> bool:
    """True if driver values u (d,) are near some of a run's (n, d) against how far these go, or if one stands still."""
    reach = np.ptp(values, axis=0)
    if not reach.all():
        return True
    return bool((np.abs(values - u) / reach).max(axis=1).min() <= _BESIDE)


def _standing(mechanism: Mechanism, problem: KinfmuError) -> Instant:
    """The start pose alone, of all rows or, where drivers contradict, of the joints."""
    local, origin = localized(mechanism)
    system = System(local)
    assembled = assemble(system)
    if assembled is not None:
        q = assembled.q
    else:
        q, gap = close(Part(system, range(system.joint_row_count)), rough_start(system), start_targets(system))
        if gap > CLOSED:
            raise problem
    return Instant(mechanism, _by_body(mechanism, q, origin), {driver.name: 1.0 for driver in mechanism.drivers})


def _by_body(mechanism: Mechanism, q: FloatArray, origin: Point) -> dict[str, FloatArray]:
    """Pose (1, 3) by body, the ground too, from all coordinates q, which count from `origin`."""
    poses = q.reshape(-1, 3) + np.array([origin.x, origin.y, 0.0])
    found = {body.name: pose[None] for body, pose in zip(mechanism.moving_bodies, poses, strict=True)}
    return found | {GROUND_NAME: np.zeros((1, 3))}
