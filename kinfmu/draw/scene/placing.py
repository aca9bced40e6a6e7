"""Poses of bodies and places of their points over a run; coordinates that are not outputs are recomputed."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.members import COORDINATES
from kinfmu.run import Run

if TYPE_CHECKING:
    from kinfmu.plan import SolvePlan

_AGREEMENT = 1e-6  # [rad, sizes]; largest difference of recomputed coordinates from those of the run
_plans: deque[tuple[Mechanism, SolvePlan]] = deque(maxlen=4)


def poses_of(run: Run, mechanism: Mechanism) -> tuple[dict[str, FloatArray], dict[str, tuple[str, ...]]]:
    """Return poses (n, 3) by body, and for each body that cannot be drawn the missing coordinates.

    Coordinates that are not outputs of the run are recomputed, if they follow from its drivers' values.
    """
    columns: dict[str, FloatArray] = {
        name: run.values[:, k] for k, name in enumerate(run.outputs) if name not in run.absent
    }
    columns |= {name: np.full(len(run), value) for name, value in run.fixed.items()}
    if not columns.keys() >= set(mechanism.coordinate_names):
        columns |= recomputed(run, mechanism) or {}
    poses: dict[str, FloatArray] = {}
    left_out: dict[str, tuple[str, ...]] = {}
    for body in mechanism.moving_bodies:
        names = [f"{body.name}.{coordinate}" for coordinate in COORDINATES]
        missing = tuple(name for name in names if name not in columns)
        if missing:
            left_out[body.name] = missing
        else:
            pose = np.column_stack([columns[name] for name in names])
            known = run.good & np.isfinite(pose).all(axis=1)
            poses[body.name] = np.where(known[:, None], pose, np.nan)
    return poses, left_out


def world(pose: FloatArray, s: tuple[float, float] | tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return world coordinates r + A s, (n, 2), of the body-fixed point s in poses (n, 3), or of points in one pose."""
    x, y, phi = pose.T
    c, sin = np.cos(phi), np.sin(phi)
    return np.column_stack([x + c * s[0] - sin * s[1], y + sin * s[0] + c * s[1]])


def seen_from(pose: FloatArray, r: FloatArray) -> FloatArray:
    """Return body-fixed coordinates A^T (r_p - r), (n, 2), of points r_p (n, 2) of the world, in poses (n, 3)."""
    x, y, phi = pose.T
    c, sin = np.cos(phi), np.sin(phi)
    d_x, d_y = r[:, 0] - x, r[:, 1] - y
    return np.column_stack([c * d_x + sin * d_y, c * d_y - sin * d_x])


def recomputed(run: Run, mechanism: Mechanism) -> Mapping[str, FloatArray] | None:
    """Return all coordinates (n,) by name, NaN in a gap; None if they cannot be computed.

    A run of few outputs, as [outputs] or --outputs choose them, is solved for all coordinates at its drivers' values.
    The result must agree with the coordinates in the run; columns left out by --channels are not recomputed.
    """
    from kinfmu.run.solve import solve

    values = run.input_names[::3]
    if not values or run.absent.intersection(values) or run.absent.intersection(run.outputs):
        return None
    try:
        plan = _plan_of_all(_as_run(run, mechanism))
        good = np.flatnonzero(run.good)
        if not len(good):
            return {name: np.full(len(run), np.nan) for name in (*plan.outputs, *plan.fixed)}
        found = solve(plan, **{name: run.inputs[good, 3 * k] for k, name in enumerate(values)})
    except KinfmuError:
        return None
    columns: dict[str, FloatArray] = {name: found[name] for name in (*plan.outputs, *plan.fixed)}
    for name in run.names:
        if name not in columns:
            continue
        size = 1.0 if name.is_angle else plan.size
        if not np.all(np.abs(columns[name] - run[name][good]) <= _AGREEMENT * size):  # False for NaN
            return None
    return {name: _spread(column, good, len(run)) for name, column in columns.items()}


def poses_after(run: Run, mechanism: Mechanism, row: int, u: Sequence[float]) -> dict[str, FloatArray] | None:
    """Return poses (1, 3) by body at driver values u (d,), solved along the run up to `row`, and on from there.

    None if the run does not hold its driver values, u cannot be reached, or the pose solved at `row` is not the run's.
    """
    from kinfmu.run.solve import solve

    values = run.input_names[::3]
    if not values or run.absent.intersection(values):
        return None
    rows = np.append(np.flatnonzero(run.good[:row]), row)
    inputs: dict[str, Any] = {name: np.append(run.inputs[rows, 3 * k], u[k]) for k, name in enumerate(values)}
    try:
        plan = _plan_of_all(_as_run(run, mechanism))
        found = solve(plan, **inputs)
    except KinfmuError:
        return None
    for name in (*run.names, *run.fixed):
        size = 1.0 if name.is_angle else plan.size
        if name not in run.absent and not abs(found[name][-2] - run[name][row]) <= _AGREEMENT * size:
            return None
    if not found.good[-1]:
        return None
    return {body: pose[-1:] for body, pose in poses_of(found, mechanism)[0].items()}


def _as_run(run: Run, mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with the parameters and assembly of the run, and with all coordinates as outputs."""
    from kinfmu.run.continued import continued

    settings = (entry.partition(" = ") for entry in run.info.get("parameters", "").split(", "))  # of an FMU
    values = {**run.info, **{name: value for name, _, value in settings}}
    changed: dict[str, float | str] = {}
    for name, parameter in mechanism.parameters.items():
        try:
            value = float(values[name])
        except (KeyError, ValueError):
            continue
        if parameter.expression is None and value != float(parameter.value):
            changed[name] = value
    return replace(continued(mechanism, changed).mechanism, coordinates="all", points={})


def _plan_of_all(mechanism: Mechanism) -> SolvePlan:
    """Return the plan of a mechanism; the last ones are kept, because records are drawn piece by piece."""
    from kinfmu.plan import compile_plan

    for known, plan in _plans:
        if known == mechanism:
            return plan
    plan = compile_plan(mechanism)
    _plans.append((mechanism, plan))
    return plan


def _spread(column: FloatArray, rows: IntArray, count: int) -> FloatArray:
    """Return a column of `count` samples with values at some rows and NaN at the others."""
    found = np.full(count, np.nan)
    found[rows] = column
    return found


def remedy(run: Run, names: Iterable[str]) -> str:
    """Return how to get missing coordinates into a run, which depends on how they were left out."""
    if run.absent.intersection(names):
        return "keep them: --channels all, or q among its names"
    return "name them in [outputs] coordinates, or leave that out"
