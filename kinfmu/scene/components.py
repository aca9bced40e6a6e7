"""Mechanisms of a system: the run of each FMU that carries one, from the signals of the run of the system."""

from __future__ import annotations

import numpy as np

from kinfmu.mechanism import toml_file
from kinfmu.run import Run
from kinfmu.run.components import MAIN, other_mechanisms
from kinfmu.solver.python.status import Status


def component_runs(run: Run) -> dict[str, Run]:
    """Return the runs of the mechanisms in a system by component, that of the run itself first.

    They hold the motion of the others, which are signals such as 'lift.crank.phi', without rates and accelerations.
    Outputs that were not recorded are missing. A system of one mechanism has none.
    """
    if MAIN not in run.info or run.signals is None:
        return {}
    others = other_mechanisms(run.info)
    return {run.info[MAIN]: run} | {name: _of(run, name, text) for name, text in others.items()}


def _of(run: Run, component: str, text: str) -> Run:
    """Return the run of one component."""
    from kinfmu.plan import compile_plan

    mechanism = toml_file.parse(text, f"the mechanism of {component}")
    plan = compile_plan(mechanism)
    signals = {str(name): k for k, name in enumerate(run.signal_names) if name not in run.absent}
    assert run.signals is not None  # noqa: S101  # for the type

    def column(name: str) -> int | None:
        return signals.get(f"{component}.{name}")

    outputs = tuple(name for name in plan.outputs if column(name) is not None)
    values = run.signals[:, [signals[f"{component}.{name}"] for name in outputs]]
    place = column("solver.status")
    status = np.zeros(len(run), np.int64)
    if place is not None:
        known = np.isfinite(run.signals[:, place])
        status = np.where(known, run.signals[:, place], Status.NOT_CONVERGED).astype(np.int64)
    status = np.where(np.isfinite(values).all(axis=1), status, Status.NOT_CONVERGED)
    unknown = np.full(values.shape, np.nan)
    return run.replaced(
        outputs=outputs,
        coordinate_count=sum(name in plan.coordinates for name in outputs),
        values=np.where((status <= Status.BRIDGED)[:, None], values, np.nan),
        rates=unknown,
        accelerations=unknown,
        fixed=dict(plan.fixed),
        input_names=(),
        inputs=np.empty((len(run), 0)),
        status=status,
        watch_names=(),
        watch=np.empty((len(run), 0)),
        force_names=(),
        forces=None,
        reaction_names=(),
        reactions=None,
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
