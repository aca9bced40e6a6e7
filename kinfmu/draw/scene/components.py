"""Mechanisms of a system: the run of each FMU that carries one, from the signals of the run of the system."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import toml_file
from kinfmu.run import Run
from kinfmu.run.components import MAIN, other_mechanisms
from kinfmu.solver.python.status import Status


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
        known = np.isfinite(run.signals[:, place])
        status = np.where(known, run.signals[:, place], Status.NOT_CONVERGED).astype(np.int64)
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
