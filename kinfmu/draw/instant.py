"""The instant that a figure shows: the start pose, or one of the run in which links do not hide one another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.marks import value_text
from kinfmu.draw.scene.instant import Instant, OpenGap, directions
from kinfmu.draw.scene.placing import poses_of, world
from kinfmu.draw.scene.shape import points_of, rim
from kinfmu.errors import FigureError, KinfmuError, listed
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import Distance, Translational
from kinfmu.mechanism.quantities.placement import body_of, unit_vector
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.plan.equations.assembly import find_assembly
from kinfmu.plan.equations.closing import CLOSED, close
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.system import System
from kinfmu.plan.open_loop import OpenLoop
from kinfmu.run import Run
from kinfmu.run.driving import run_times
from kinfmu.run.solve import solve

MOST_SAMPLES = 1000  # of the run, in a figure
_NEAR_RUN = 0.1  # of a driver's range; a start pose further from the run is a rough guess
_CLEAR = 0.04  # of all links; if no more is covered, no other pose is looked for
_CANDIDATES = 24  # poses of a run that are compared
_DOTS = np.linspace(0.12, 0.88, 9)  # along each link, without the ends near its pins
_NEAR_LINK = 0.025  # of the size; a dot nearer to another link is covered
_SAME = 1e-6  # of the size; points that are nearer are one pin
_PIN = 0.05  # cost of a pin that covers a link of another joint
_MOST_LINKS = 60  # with more links no pose is clearly better than the start


def instant(
    mechanism: Mechanism, at: float | None = None, *, with_gap: bool = False, plan: SolvePlan | None = None
) -> Instant:
    """Return the pose of a mechanism to draw, and its run.

    at: value of the only driver [rad or length]. Default: the start of the run, if links do not hide one another there;
    else the assembled pose, if it is near the run, or the sample of the run in which they hide one another least. A
    mechanism that closes but cannot be solved, for example without a driver, is shown at the start pose without a run.
    with_gap: a mechanism that does not close is shown with its loops closed up to the first open one, and its gap.
    plan: of the mechanism, if it is compiled already; one of some coordinates or of another mechanism is not used.
    A KinfmuError is raised if `at` cannot be reached or, without `with_gap`, the mechanism does not close.
    """
    try:
        if plan is None or plan.mechanism is not mechanism or not isinstance(mechanism.coordinates, str):
            plan = compile_plan(replace(mechanism, coordinates="all"))
    except KinfmuError as problem:
        if at is not None:
            raise
        return _without_run(mechanism, problem, with_gap=with_gap)
    return _with_run(mechanism, plan, at)


def _with_run(mechanism: Mechanism, plan: SolvePlan, at: float | None) -> Instant:
    times = run_times(mechanism.run)
    run = solve(plan, times[:: -(-len(times) // MOST_SAMPLES)])
    poses, _ = poses_of(run, mechanism)
    poses[GROUND_NAME] = np.zeros((len(run), 3))
    ways = directions(run, mechanism)
    is_clearest = False
    if at is not None:
        drawn = _poses_at(mechanism, plan, at)
    elif run.good[0] and _is_clear(mechanism, first := {name: pose[:1] for name, pose in poses.items()}):
        drawn = first
    else:
        drawn, is_clearest = _clearest_poses(mechanism, plan, run, poses), True
    shown = {name: np.vstack([drawn[name], pose]) for name, pose in poses.items()}
    return Instant(mechanism, shown, ways, is_clearest=is_clearest)


def pose_note(shown: Instant) -> str:
    """Return a sentence on the start of the run and the reason, if the drawn pose is another one; '' without a run."""
    mechanism = shown.mechanism
    starts = [float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers]
    values = [shown.value(driver.name) for driver in mechanism.drivers]
    if len(shown.poses[GROUND_NAME]) == 1 or np.allclose(values, starts, rtol=1e-9, atol=1e-9):
        return ""
    texts = [f"{d.name} = {value_text(shown, d, start)}" for d, start in zip(mechanism.drivers, starts, strict=True)]
    why = "clearest pose; " if shown.is_clearest else ""
    return f"{why}the run starts at {listed(texts)}"


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


def _clearest_poses(
    mechanism: Mechanism, plan: SolvePlan, run: Run, poses: dict[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body in which links hide one another least: assembled, or of the run."""
    start = _by_body(mechanism, plan.anchor.q, plan.origin)
    values = run.inputs[:, ::3]  # (n, d)
    is_met = not run.good.any() or _is_near(plan.anchor.u, values[run.good])
    choice = {name: np.vstack([start[name], pose]) if is_met else pose for name, pose in poses.items()}
    row = _clearest_row(mechanism, choice)
    return {name: choice[name][row][None] for name in poses}


def _is_near(u: FloatArray, values: FloatArray) -> bool:
    """Return True if driver values u (d,) are near one of a run's (n, d), or if a driver does not move in the run."""
    ranges = np.ptp(values, axis=0)
    if not ranges.all():
        return True
    return bool((np.abs(values - u) / ranges).max(axis=1).min() <= _NEAR_RUN)


def _without_run(mechanism: Mechanism, problem: KinfmuError, *, with_gap: bool) -> Instant:
    """Return only the start pose: closed with all rows, with the gap of an open loop, or closed by the joints alone."""
    open_gap = None
    local, origin = localized(mechanism)
    system = System(local)
    start, assembled = find_assembly(system)
    if assembled is not None:
        q = assembled.q
    else:
        loop = problem.data.get("loop")
        if with_gap and isinstance(loop, OpenLoop):  # it may close at other driver values, which would hide the gap
            q, open_gap = loop.pose, OpenGap(loop.joint, f"gap {loop.gap:.4g} {loop.unit}")
        else:
            q, gap = close(Part(system, range(system.joint_row_count)), start.q, start.u)
            if gap > CLOSED:
                raise problem
    ways = {driver.name: 1.0 for driver in mechanism.drivers}
    return Instant(mechanism, _by_body(mechanism, q, origin), ways, open_gap)


def _by_body(mechanism: Mechanism, q: FloatArray, origin: Point) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body and for the ground, from all coordinates q relative to `origin`."""
    poses = q.reshape(-1, 3) + np.array([origin.x, origin.y, 0.0])
    found = {body.name: pose[None] for body, pose in zip(mechanism.moving_bodies, poses, strict=True)}
    return found | {GROUND_NAME: np.zeros((1, 3))}


def _is_clear(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> bool:
    """Return whether links do not hide one another in the only pose (1, 3) of each body."""
    owners, links = _links(mechanism, poses)
    return not 1 < len(owners) <= _MOST_LINKS or round(_covered(owners, links[0]), 6) <= _CLEAR


def _clearest_row(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> int:
    """Return the row of poses (n, 3) by body in which links hide one another least, or the first clear one."""
    rows = list(dict.fromkeys(np.linspace(0, len(poses[GROUND_NAME]) - 1, _CANDIDATES + 1).astype(int).tolist()))
    rows = [row for row in rows if all(np.isfinite(pose[row]).all() for pose in poses.values())]
    owners, links = _links(mechanism, {body: pose[rows] for body, pose in poses.items()})  # (r, links, 2, 2)
    if not 1 < len(owners) <= _MOST_LINKS:
        return int(rows[0])
    covered = []
    for ends in links:
        covered.append(round(_covered(owners, ends), 6))
        if covered[-1] <= _CLEAR:
            return int(rows[len(covered) - 1])
    return int(rows[int(np.argmin(covered))])


def _links(mechanism: Mechanism, poses: Mapping[str, FloatArray]) -> tuple[list[str], FloatArray]:
    """Return the owners of all straight edges, and their ends (r, links, 2, 2) in the world."""
    owners: list[str] = []
    ends: list[FloatArray] = []

    def add(owner: str, a: FloatArray, b: FloatArray) -> None:
        owners.append(owner)
        ends.append(np.stack([a, b], axis=1))  # (r, 2, 2)

    for body in mechanism.moving_bodies:
        corners, is_closed = rim(points_of(body))
        tracks = [world(poses[body.name], (x, y)) for x, y in corners]
        for k in range(len(tracks) - (not is_closed)):
            add(body.name, tracks[k], tracks[(k + 1) % len(tracks)])
    points = mechanism.body_points
    for joint in mechanism.joints:
        if isinstance(joint, Distance):
            a, b = (world(poses[body_of(end)], points[end]) for end in joint.between)
            add(joint.name, a, b)
        elif isinstance(joint, Translational) and body_of(joint.between[0]) == GROUND_NAME:
            origin = np.array(points[joint.between[0]])
            along = np.array(unit_vector(joint.axis))
            track = world(poses[body_of(joint.between[1])], points[joint.between[1]])
            way = (track - origin) @ along
            first, last = (np.tile(origin + end * along, (len(track), 1)) for end in (way.min(), way.max()))
            add(body_of(joint.between[1]), first, last)  # a rail may lie under its own slider
    return owners, np.stack(ends, axis=1) if ends else np.empty((0, 0, 2, 2))


def _covered(owners: list[str], ends: FloatArray) -> float:
    """Return the part of all links, with pins, that covers links of other bodies; ends: (links, 2, 2)."""
    names = np.array(owners)
    size = float(np.ptp(ends.reshape(-1, 2), axis=0).max())
    dots = (ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * _DOTS[:, None]).reshape(-1, 2)  # (links * dots, 2)
    is_own = np.repeat(names, len(_DOTS))[:, None] == names[None, :]
    hidden = np.where(is_own, np.inf, _distances(dots, ends)).min(axis=1) < _NEAR_LINK * size
    pins = ends.reshape(-1, 2)
    apart = np.hypot(*(pins[:, None] - pins[None]).transpose(2, 0, 1)) > _SAME * size  # (pins, pins)
    meets = ~apart.reshape(len(pins), len(names), 2).all(axis=2)  # (pins, links)
    is_held = meets @ (names[:, None] == names[None, :])  # by any link of the owner
    lies_on = np.where(is_held, np.inf, _distances(pins, ends)).min(axis=1) < _NEAR_LINK * size
    return float(hidden.mean() + _PIN * lies_on.sum())


def _distances(dots: FloatArray, ends: FloatArray) -> FloatArray:
    """Return distances (k, links) of dots (k, 2) from straight links."""
    a, d = ends[:, 0], ends[:, 1] - ends[:, 0]
    part = ((dots[:, None] - a[None]) * d[None]).sum(axis=2) / np.maximum((d * d).sum(axis=1), 1e-30)
    nearest = a[None] + np.clip(part, 0.0, 1.0)[:, :, None] * d[None]
    return np.asarray(np.hypot(*(dots[:, None] - nearest).transpose(2, 0, 1)))
