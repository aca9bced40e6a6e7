"""Simulate a mechanism whose drivers apply given efforts, and return its samples as a Run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError, listed, suggestion, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.motion.torque.efforts import Efforts, jumps_of_loads, read_efforts
from kinfmu.motion.torque.integrated import METHODS, IntegratedMotion, Sample
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.efforts import effort_inputs
from kinfmu.run import Event, Run
from kinfmu.run.axis import TIME
from kinfmu.run.continued import Settings, continued
from kinfmu.run.driving import applied_efforts
from kinfmu.run.forces import ForceModel, LoadedRun, force_plan
from kinfmu.run.model import Model
from kinfmu.run.verdict import coarse_samples
from kinfmu.solver.python.pose import Status, Vector
from kinfmu.solver.python.solver import LEAST_TOLERANCE, MOST_TOLERANCE, STEP_TOLERANCE


def torque_driven(
    mechanism: Mechanism,
    times: FloatArray,
    *,
    inputs: Mapping[str, Any] | None = None,
    state: Mapping[str, float] | None = None,
    parameters: Settings | None = None,
    tolerance: float | None = None,
    method: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Run:
    """Integrate the motion of a mechanism under efforts of its drivers.

        J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

    Args:
        mechanism: The mechanism, with masses.
        times: (n,) of the samples [s], increasing; the first is the start.
        inputs: Efforts by the names of inputs, such as crank_torque [N m] or wind_force [N]; 0 by default.
        state: Initial values and speeds, such as crank_angle [rad] and crank_speed [rad/s]. Default: of the laws.
        parameters: Values of parameters and law constants, as in `solve`.
        tolerance: Error of a step in rad and sizes, for fast speeds relative; 1e-13 to 1e-4. Default: 1e-9.
        method: 'DOP853', or 'Radau' for stiff dampers and springs. Default: 'DOP853'.
        progress: Called with (samples done, number of samples).

    Returns:
        The run over time. A motion that reaches a limit ends there: its last sample has the status and no numbers, and
        an event of level "error" states driver, value and limit.

    Raises:
        RequestError: A name is unknown, a value is invalid, or a driver moves no mass.
        KinfmuError: The mechanism cannot be solved.

    """
    tolerance = STEP_TOLERANCE if tolerance is None else tolerance
    method = "DOP853" if method is None else method
    if not (is_number(tolerance) and LEAST_TOLERANCE <= tolerance <= MOST_TOLERANCE):
        raise RequestError(f"tolerance = {quoted(tolerance)} must be {LEAST_TOLERANCE:g} to {MOST_TOLERANCE:g}")
    if method not in METHODS:
        raise RequestError(f"method {quoted(method)} is not known{suggestion(method, METHODS)}; {listed(METHODS)}")
    require_masses(mechanism)
    changed = continued(mechanism, parameters or {})
    plan = compile_plan(changed.mechanism, None, [])
    ends = (float(times[0]), float(times[-1]))
    efforts = read_efforts(effort_inputs(plan), inputs or {}, ends)
    jumps = sorted({*efforts.jumps, *jumps_of_loads(changed.mechanism.loads, ends)})
    efforts = efforts._replace(jumps=tuple(jumps))
    u, ud = _initial_state(plan, ends[0], state or {})
    motion = IntegratedMotion(force_plan(plan), efforts, tolerance=float(tolerance), method=method)
    samples = []
    for sample in motion.samples(u, ud, times.tolist()):
        samples.append(sample)
        if progress is not None:
            progress(len(samples), len(times))
    events = [Event(ends[0], "info", changed.message)] if changed.message else []
    t, values, speeds = (np.array([sample[k] for sample in samples]) for k in range(3))
    coarse = coarse_samples(t, [driver.inputs[0] for driver in plan.drivers], values, speeds)
    if coarse:
        events.append(Event(ends[0], "info", coarse))
    limit = motion.limit
    if limit is not None:
        samples.append(Sample(limit.t, limit.u, motion.speeds, (0.0,) * len(u)))
        events.append(Event(limit.t, "error", f"at t = {limit.t:.9g} s {limit.message}"))
    run = _run(Model(plan), samples, efforts, tuple(events), ended=limit is not None)
    about = {"drive": "torque", "method": method, "tolerance": repr(float(tolerance)), "steps": str(motion.step_count)}
    return run.replaced(info={**run.info, **about})


def _initial_state(plan: SolvePlan, start: float, given: Mapping[str, float]) -> tuple[Vector, Vector]:
    """Return values and speeds of the drivers at the start."""
    known = [name for driver in plan.drivers for name in driver.inputs[:2]]
    for name, value in given.items():
        if name not in known:
            raise RequestError(f"state '{name}' is not known{valid_names(name, known, 'states')}")
        if not (is_number(value) and np.isfinite(value)):
            raise RequestError(f"{name} = {quoted(value)} must be a finite number")
    u, ud, _ = load_model(plan).drive(start, tuple(constant.value for constant in plan.law_constants))
    values, speeds = (
        tuple(float(given.get(driver.inputs[order], one)) for driver, one in zip(plan.drivers, by_law, strict=True))
        for order, by_law in enumerate((u, ud))
    )
    return values, speeds


def _run(model: Model, samples: list[Sample], efforts: Efforts, events: tuple[Event, ...], *, ended: bool) -> Run:
    """Return the run of samples: solved at their driver values, with the forces over time."""
    t = np.array([sample.t for sample in samples])
    u, ud, udd = (np.array([sample[order] for sample in samples]) for order in (1, 2, 3))  # (n, d)
    inputs: dict[str, Any] = {
        name: table[:, k]
        for k, driver in enumerate(model.plan.drivers)
        for name, table in zip(driver.inputs, (u, ud, udd), strict=True)
    }
    loads = list(efforts.by_name)[len(model.plan.drivers) :]
    applied = _load_efforts(model.plan, samples, efforts) if loads else {}
    poses = model if force_plan(model.plan) is model.plan else Model(force_plan(model.plan))
    forces = ForceModel(poses)

    def loaded() -> LoadedRun:
        solved, setting = run if poses is model else poses.solve(**inputs), model.arguments.setting({})
        return LoadedRun(solved, (u, ud, udd), True, setting, applied_efforts(loads, applied, len(t)), t)

    run = model.solve(**inputs)
    if ended:  # the limit, however near the last sample is to it
        run = run.replaced(status=np.append(run.status[:-1], max(int(run.status[-1]), int(Status.OUTSIDE))))
    return run.replaced(
        t=t,
        axis=TIME,
        events=events,
        forces=lambda: forces.forces(loaded()),
        reactions=lambda: forces.reactions(loaded()),
        shaking=lambda: forces.shaking(loaded()),
    )


def _load_efforts(plan: SolvePlan, samples: list[Sample], efforts: Efforts) -> dict[str, FloatArray]:
    """Return the efforts of external loads at the samples, by name."""
    names = [name for driver in plan.drivers for name in driver.inputs[:2]]
    rows = []
    for sample in samples:
        pairs = (x for pair in zip(sample.u, sample.ud, strict=True) for x in pair)
        rows.append(efforts.at(sample.t, dict(zip(names, pairs, strict=True))))
    table = np.array(rows)
    return {name: table[:, k] for k, name in enumerate(efforts.by_name) if k >= len(plan.drivers)}
