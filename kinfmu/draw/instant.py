"""The instant that a figure shows: the start pose, or one of the run in which links do not hide one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kinfmu.draw.view import clearest
from kinfmu.equations.assembly import CLOSED, assemble, close, rough_start, start_targets
from kinfmu.equations.part import Part
from kinfmu.equations.system import System
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.run import FloatArray
from kinfmu.shapes.instant import Instant
from kinfmu.shapes.placing import poses_of
from kinfmu.sweep import run_times, solve

MOST_SAMPLES = 1000  # of the run; a figure shows no more
_BESIDE = 0.1  # part of a driver's way; a start pose further from the run is a rough guess


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
