"""The instant that a figure shows: the start pose, or one of the run in which links do not hide one another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kinfmu.draw.motion import value_text
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

MOST_SAMPLES = 1000  # of the run, in a figure
_NEAR = 0.1  # of a driver's range; a start pose further from the run is a rough guess


def instant(mechanism: Mechanism, at: float | None = None) -> Instant:
    """Return the pose of a mechanism to draw, and its run.

    at: value of the only driver [rad or length]. Default: the start of the run, if links do not hide one another there;
    else the assembled pose, if it is near the run, or the sample of the run in which they hide one another least. A
    mechanism that closes but cannot be solved, for example without a driver, is shown at the start pose without a run.
    A KinfmuError is raised if the mechanism does not close or `at` cannot be reached.
    """
    try:
        plan = compile_plan(replace(mechanism, coordinates="all"))
    except KinfmuError as problem:
        if at is not None:
            raise
        return _without_run(mechanism, problem)
    return _with_run(mechanism, plan, at)


def _with_run(mechanism: Mechanism, plan: SolvePlan, at: float | None) -> Instant:
    times = run_times(mechanism.run)
    run = solve(plan, times[:: -(-len(times) // MOST_SAMPLES)])
    poses, _ = poses_of(run, mechanism)
    poses[GROUND_NAME] = np.zeros((len(run), 3))
    directions = _directions(mechanism, run)
    if at is not None:
        drawn = _poses_at(mechanism, plan, at)
    elif run.good[0] and is_clear(mechanism, first := {name: pose[:1] for name, pose in poses.items()}):
        drawn = first
    else:
        drawn = _clearest(mechanism, plan, run, poses)
    return Instant(mechanism, {name: np.vstack([drawn[name], pose]) for name, pose in poses.items()}, directions)


def pose_note(shown: Instant) -> str:
    """Return a sentence on the start of the run, if the drawn pose is another one; '' without a run."""
    mechanism = shown.mechanism
    starts = [float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers]
    values = [shown.value(driver.name) for driver in mechanism.drivers]
    if len(shown.poses[GROUND_NAME]) == 1 or np.allclose(values, starts, rtol=1e-9, atol=1e-9):
        return ""
    texts = [f"{d.name} = {value_text(shown, d, start)}" for d, start in zip(mechanism.drivers, starts, strict=True)]
    return f"the run starts at {listed(texts)}"


def _poses_at(mechanism: Mechanism, plan: SolvePlan, at: float) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body at a value of the only driver."""
    if len(plan.drivers) != 1:
        names = listed(driver.name for driver in mechanism.drivers)
        raise FigureError(f"a figure at a driver's value needs a mechanism with one driver; drivers: {names}")
    inputs: dict[str, Any] = {plan.drivers[0].inputs[0]: at}
    run = solve(plan, **inputs)
    if not run.good[0]:
        raise FigureError(run.events[0].text)
    return poses_of(run, mechanism)[0] | {GROUND_NAME: np.zeros((1, 3))}


def _clearest(mechanism: Mechanism, plan: SolvePlan, run: Run, poses: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body in which links hide one another least: assembled, or of the run."""
    start = _by_body(mechanism, plan.anchor.q, plan.origin)
    values = run.inputs[:, ::3]  # (n, d)
    is_met = not run.good.any() or _is_near(plan.anchor.u, values[run.good])
    choice = {name: np.vstack([start[name], pose]) if is_met else pose for name, pose in poses.items()}
    row = clearest(mechanism, choice)
    return {name: choice[name][row][None] for name in poses}


def _directions(mechanism: Mechanism, run: Run) -> dict[str, float]:
    """Return +1.0 or -1.0 by driver, the direction of its first motion."""
    directions = {}
    for k, driver in enumerate(mechanism.drivers):
        speeds = run.inputs[:, 3 * k + 1]
        moving = speeds[speeds != 0.0]
        directions[driver.name] = float(np.sign(moving[0])) if len(moving) else 1.0
    return directions


def _is_near(u: FloatArray, values: FloatArray) -> bool:
    """Return True if driver values u (d,) are near one of a run's (n, d), or if a driver does not move in the run."""
    ranges = np.ptp(values, axis=0)
    if not ranges.all():
        return True
    return bool((np.abs(values - u) / ranges).max(axis=1).min() <= _NEAR)


def _without_run(mechanism: Mechanism, problem: KinfmuError) -> Instant:
    """Return only the start pose, closed with all rows or, if drivers contradict them, with those of the joints."""
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
    """Return poses (1, 3) by body and for the ground, from all coordinates q relative to `origin`."""
    poses = q.reshape(-1, 3) + np.array([origin.x, origin.y, 0.0])
    found = {body.name: pose[None] for body, pose in zip(mechanism.moving_bodies, poses, strict=True)}
    return found | {GROUND_NAME: np.zeros((1, 3))}
