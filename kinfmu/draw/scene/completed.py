"""What a run does not hold: margins and estimated errors, and the runs of the mechanisms in a system."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import toml_file
from kinfmu.run import Run
from kinfmu.run.components import MAIN, other_mechanisms
from kinfmu.solver.python.pose import Status
from kinfmu.solver.python.solver import TOLERANCE

COST = 4  # of a sample with its estimates, in samples without
SAME_POSE = 1e-6  # [rad, sizes]; a pose that differs by more has another margin


def with_estimates(run: Run) -> Run:
    """Return the run with margins and errors that are computed from its mechanism and driver values when read.

    They are NaN where the mechanism cannot be solved there. An error is at least the difference of the run's numbers
    from those solved again.
    """

    @cache
    def both() -> tuple[FloatArray, FloatArray]:
        return _estimates(run)

    return run.replaced(margin=lambda: both()[0], error=lambda: both()[1])


def _estimates(run: Run) -> tuple[FloatArray, FloatArray]:
    """Return margins (n,) and estimated errors (n, 3)."""
    from kinfmu.run.solve import kept_model  # a record is written and read without the planner

    margin, error = np.full(len(run), np.nan), np.full((len(run), 3), np.nan)
    rows = np.flatnonzero(run.good)
    try:
        if run.mechanism is None or not len(rows):
            return margin, error
        outputs = tuple(map(str, run.outputs))
        model = kept_model(run.mechanism, outputs, (), "auto")
        if model.is_native(COST * len(rows), if_cached=True):
            model = model.by("native")
        inputs: dict[str, Any] = dict(zip(run.input_names, run.inputs[rows].T, strict=True))
        closed = max(
            np.max(gaps, initial=TOLERANCE, where=np.isfinite(gaps)) for gaps in (run.residual, abs(run.watch))
        )
        again = model.solve(tolerance=2.0 * float(closed), **inputs)  # what the run's own tolerance allowed
    except KinfmuError:
        return margin, error
    scales = np.array([1.0 if name.is_angle else model.plan.size for name in run.outputs])
    for k, table in enumerate(("values", "rates", "accelerations")):
        apart = _apart(getattr(again, table), getattr(run, table), rows, scales)
        error[rows, k] = np.maximum(again.error[:, k], apart)
        if k == 0:
            margin[rows] = np.where(apart <= SAME_POSE, again.margin, np.nan)
    return margin, error


def _apart(solved: FloatArray, held: FloatArray, rows: IntArray, scales: FloatArray) -> FloatArray:
    """Return the largest difference of each row from that of a run, (n,); rows: of the run, which is larger."""
    found = np.zeros(len(rows))
    for k, scale in enumerate(scales.tolist()):  # columns of solved tables are contiguous
        held_there = held[:, k] if len(rows) == len(held) else held[rows, k]
        apart = np.subtract(solved[:, k], held_there)
        np.abs(apart, out=apart)
        apart /= scale
        if not np.isfinite(apart).all():  # a column that was not kept is NaN
            apart[~np.isfinite(apart)] = 0.0
        np.maximum(found, apart, out=found)
    return found


def component_runs(run: Run) -> dict[str, Run]:
    """Return the runs of the mechanisms in a system by component, that of the run itself first.

    They hold motion and forces of the others, which are signals such as 'lift.crank.phi'. Outputs that were not
    recorded are missing. A system of one mechanism has none.
    """
    if MAIN not in run.info or run.signals is None:
        return {}
    others = other_mechanisms(run.info)
    return {run.info[MAIN]: run} | {name: _of(run, name, text) for name, text in others.items()}


def _of(run: Run, component: str, text: str) -> Run:
    """Return the run of one component."""
    from kinfmu.plan import compile_plan
    from kinfmu.plan.forces import force_names
    from kinfmu.plan.reactions import reaction_names_of

    mechanism = toml_file.parse(text, f"the mechanism of {component}")
    plan = compile_plan(mechanism)
    signals = {str(name): k for k, name in enumerate(run.signal_names) if name not in run.absent}
    assert run.signals is not None  # noqa: S101  # for the type

    def column(name: str) -> int | None:
        return signals.get(f"{component}.{name}")

    outputs = tuple(name for name in plan.outputs if column(name) is not None)
    values, rates, accelerations = (
        _table(run, [column(name.derivative(order)) for name in outputs]) for order in range(3)
    )
    place = column("solver.status")
    status = np.zeros(len(run), np.int64)
    if place is not None:
        is_recorded = np.isfinite(run.signals[:, place])
        status = np.where(is_recorded, run.signals[:, place], Status.NOT_CONVERGED).astype(np.int64)
    status = np.where(np.isfinite(values).all(axis=1), status, Status.NOT_CONVERGED)
    forces, reactions = (
        [name for name in names if column(name) is not None]
        for names in (force_names(mechanism), reaction_names_of(mechanism))
    )
    return run.replaced(
        outputs=outputs,
        coordinate_count=sum(name in plan.coordinates for name in outputs),
        values=np.where((status <= Status.BRIDGED)[:, None], values, np.nan),
        rates=rates,
        accelerations=accelerations,
        fixed=dict(plan.fixed),
        input_names=(),
        inputs=np.empty((len(run), 0)),
        status=status,
        watch_names=(),
        watch=np.empty((len(run), 0)),
        force_names=tuple(forces),
        forces=_table(run, list(map(column, forces))) if forces else None,
        reaction_names=tuple(reactions),
        reactions=_table(run, list(map(column, reactions))) if reactions else None,
        shaking=None,
        signal_names=(),
        signals=None,
        length_unit=mechanism.length_unit,
        mechanism_source=text,
        model_description="",
        info={"name": component, "title": mechanism.title},
        events=(),
        absent=frozenset(),
    )


def _table(run: Run, columns: list[int | None]) -> FloatArray:
    """Return signals as a table (n, columns); NaN where there is none."""
    table = np.full((len(run), len(columns)), np.nan)
    for k, column in enumerate(columns):
        if column is not None and run.signals is not None:
            table[:, k] = run.signals[:, column]
    return table
