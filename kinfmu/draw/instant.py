"""The instant that a figure shows: the start pose, or one of the run in which links do not hide one another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kinfmu.draw.motion import told_value
from kinfmu.draw.view import clearest, is_clear
from kinfmu.equations.assembly import find_assembly
from kinfmu.equations.closing import CLOSED, close
from kinfmu.equations.part import Part
from kinfmu.equations.system import System
from kinfmu.errors import FigureError, KinfmuError, listed
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.run import FloatArray, Run
from kinfmu.scene.instant import Instant
from kinfmu.scene.placing import poses_of
from kinfmu.sweep import run_times, solve

MOST_SAMPLES = 1000  # of the run; a figure shows no more
_BESIDE = 0.1  # part of a driver's way; a start pose further from the run is a rough guess


def instant(mechanism: Mechanism, at: float | None = None) -> Instant:
    """What to draw of a mechanism.

    at: value of the only driver [rad or length]. Without it the pose that the run starts from, if links do not lie on
    one another there; else the pose in which it is assembled, if the run comes by it, or a sample of the run in which
    they do not. A mechanism that cannot be solved, for want of a driver say, is shown at the start pose without its
    run. One that does not close raises the error that says so, as does a value that cannot be reached.
    """
    try:
        plan = compile_plan(replace(mechanism, coordinates="all"))
    except KinfmuError as problem:
        if at is not None:
            raise
        return _standing(mechanism, problem)
    return _moving(mechanism, plan, at)


def _moving(mechanism: Mechanism, plan: SolvePlan, at: float | None) -> Instant:
    times = run_times(mechanism.run)
    run = solve(plan, times[:: -(-len(times) // MOST_SAMPLES)])
    poses, _ = poses_of(run, mechanism)
    poses[GROUND_NAME] = np.zeros((len(run), 3))
    ways = _ways(mechanism, run)
    if at is not None:
        drawn = _poses_at(mechanism, plan, at)
    elif run.good[0] and is_clear(mechanism, first := {name: pose[:1] for name, pose in poses.items()}):
        drawn = first
    else:
        drawn = _clearest(mechanism, plan, run, poses)
    return Instant(mechanism, {name: np.vstack([drawn[name], pose]) for name, pose in poses.items()}, ways)


def pose_note(shown: Instant) -> str:
    """Return a sentence on where the run starts, if the drawn pose is another; empty without a run."""
    mechanism = shown.mechanism
    starts = [float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers]
    values = [shown.value(driver.name) for driver in mechanism.drivers]
    if len(shown.poses[GROUND_NAME]) == 1 or np.allclose(values, starts, rtol=1e-9, atol=1e-9):
        return ""
    told = zip(mechanism.drivers, starts, strict=True)
    return f"the run starts at {listed(f'{d.name} = {told_value(shown, d, value)}' for d, value in told)}"


def _poses_at(mechanism: Mechanism, plan: SolvePlan, at: float) -> dict[str, FloatArray]:
    """Pose (1, 3) by body at a value of the only driver."""
    if len(plan.drivers) != 1:
        names = listed(driver.name for driver in mechanism.drivers)
        raise FigureError(f"a figure at a driver's value needs a mechanism with one driver; drivers: {names}")
    inputs: dict[str, Any] = {plan.drivers[0].inputs[0]: at}
    run = solve(plan, **inputs)
    if not run.good[0]:
        raise FigureError(run.events[0].text)
    return poses_of(run, mechanism)[0] | {GROUND_NAME: np.zeros((1, 3))}


def _clearest(mechanism: Mechanism, plan: SolvePlan, run: Run, poses: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Pose (1, 3) by body in which links hide one another least: the assembled one, or one of the run."""
    start = _by_body(mechanism, plan.anchor.q, plan.origin)
    values = run.inputs[:, ::3]  # (n, d)
    is_met = not run.good.any() or _is_near(plan.anchor.u, values[run.good])
    choice = {name: np.vstack([start[name], pose]) if is_met else pose for name, pose in poses.items()}
    row = clearest(mechanism, choice)
    return {name: choice[name][row][None] for name in poses}


def _ways(mechanism: Mechanism, run: Run) -> dict[str, float]:
    """+1.0 or -1.0 by driver, which way it moves first."""
    ways = {}
    for k, driver in enumerate(mechanism.drivers):
        speeds = run.inputs[:, 3 * k + 1]
        moving = speeds[speeds != 0.0]
        ways[driver.name] = float(np.sign(moving[0])) if len(moving) else 1.0
    return ways


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
    start, assembled = find_assembly(system)
    if assembled is not None:
        q = assembled.q
    else:
        q, gap = close(Part(system, range(system.joint_row_count)), start.q, start.u)
        if gap > CLOSED:
            raise problem
    return Instant(mechanism, _by_body(mechanism, q, origin), {driver.name: 1.0 for driver in mechanism.drivers})


def _by_body(mechanism: Mechanism, q: FloatArray, origin: Point) -> dict[str, FloatArray]:
    """Pose (1, 3) by body, the ground too, from all coordinates q, which count from `origin`."""
    poses = q.reshape(-1, 3) + np.array([origin.x, origin.y, 0.0])
    found = {body.name: pose[None] for body, pose in zip(mechanism.moving_bodies, poses, strict=True)}
    return found | {GROUND_NAME: np.zeros((1, 3))}
