"""Coordinates that are not outputs of a run, recomputed for pictures from the drivers' values in the run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.errors import KinfmuError
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray, IntArray, Run

if TYPE_CHECKING:
    from kinfmu.plan import SolvePlan

_SAME = 1e-6  # [rad, sizes]; largest difference of recomputed coordinates from those of the run
_plans: deque[tuple[Mechanism, SolvePlan]] = deque(maxlen=4)


def recomputed(run: Run, mechanism: Mechanism) -> Mapping[str, FloatArray] | None:
    """Return all coordinates (n,) by name, NaN in a gap; None if they cannot be computed.

    A run of few outputs, as [outputs] or --outputs choose them, is solved for all coordinates at its drivers' values.
    The result must agree with the coordinates in the run; columns left out by --channels are not recomputed.
    """
    from kinfmu.sweep import solve

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
        if not np.all(np.abs(columns[name] - run[name][good]) <= _SAME * size):  # False for NaN
            return None
    return {name: _spread(column, good, len(run)) for name, column in columns.items()}


def _as_run(run: Run, mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with the parameters and assembly of the run, and with all coordinates as outputs."""
    from kinfmu.sweep.continued import continued

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
