"""`solve`: a mechanism at many samples, as a Run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.codegen.python import load_model, load_module
from kinfmu.errors import CompilerError, RequestError, listed, suggestion
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.run import Event, FloatArray, Run
from kinfmu.run.axis import TIME, axis_for
from kinfmu.solver.python import Solver, UnsolvableModel, with_parameters
from kinfmu.solver.python.pose import Vector
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.sweep.continued import anew, at_law_start, bound_values, continued, law_starts
from kinfmu.sweep.driving import column_of, driven_by_inputs, refuse_huge_rates, run_times, without_huge_rates
from kinfmu.sweep.engine import Driven, Engine, Tables
from kinfmu.sweep.python_engine import PythonEngine

ENGINES = ("auto", "python", "native")
WORTH_COMPILING = 300_000  # samples times blocks: Python needs a second or more for them


def solve(
    mechanism: Mechanism | SolvePlan,
    t: ArrayLike | None = None,
    *,
    parameters: Mapping[str, float | str] | None = None,
    outputs: Sequence[str] | None = None,
    engine: str = "auto",
    tolerance: float = TOLERANCE,
    wrap: bool = False,
    out: Tables | None = None,
    **inputs: ArrayLike,
) -> Run:
    """Solve positions, velocities and accelerations at times, or at driver values.

    Samples that cannot be reached are NaN with a status of 3 to 5 and an event with the reason; the run continues from
    the last good sample.

    Args:
        mechanism: The mechanism, or its plan from `compile_plan`.
        t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
        parameters: Values of parameters and law constants, such as {"crank_length": 0.2, "crank.speed": "30 rpm"}.
            Other geometry is reached by continuation from the pose of the geometry as written; if that fails, the
            mechanism is assembled anew, with an event of level "info".
        outputs: Names of the outputs to solve for; default: all. What they do not depend on is not solved.
        engine: 'python'; 'native', generated C, compiled on first use and then cached; or 'auto', native if there are
            enough samples to pay for compiling and a compiler is found.
        tolerance: Residual relative to the size above which a sample is not ok; positive.
        wrap: Unwrap angles given as inputs: a jump from 2 pi to 0 goes on forwards. Without it such a jump turns back.
        out: Three arrays (n, outputs) for values, rates and accelerations; by outputs (order="F") is faster.
        **inputs: Driver values in place of t, such as crank_angle=(n,) [rad] with crank_speed= and crank_acceleration=,
            arrays or numbers. Default speed: 1, default acceleration: 0, so that rates are per unit of the driver. The
            run's t then counts the samples, and its axis is the driver's value.

    Returns:
        The run, with a status for every sample.

    Raises:
        RequestError: A name is unknown or a value is invalid.
        KinfmuError: The mechanism cannot be solved, as `compile_plan` reports it.
        CompilerError: The engine is 'native' and no compiler is found, or it fails.

    """
    if engine not in ENGINES:
        raise RequestError(f"engine '{engine}' is not known{suggestion(engine, ENGINES)}; engines: {listed(ENGINES)}")
    if not (is_number(tolerance) and 0.0 < tolerance < math.inf):
        raise RequestError(f"tolerance = {quoted(tolerance)} must be a positive number")
    if isinstance(mechanism, SolvePlan):
        if outputs is not None:
            raise RequestError("outputs are chosen when a plan is compiled: compile_plan(mechanism, outputs)")
        plan = mechanism
    else:
        require_mechanism(mechanism, "solve")
        plan = compile_plan(mechanism, outputs)
    constants, geometry = _settings(plan, parameters or {})
    own = {name: value for name, value in (parameters or {}).items() if name not in geometry}
    plan, bound, solver, anew_note = _with_settings(plan, geometry, own, tolerance, by_law=not inputs)
    if t is None and not inputs:
        t = run_times(plan.mechanism.run)
    if t is None:
        times, u, ud, udd = driven_by_inputs(plan.drivers, inputs, wrap=wrap)
        driven, axis = (u, ud, udd), axis_for(u, tuple(driver.inputs[0] for driver in plan.drivers))
    elif wrap:
        raise RequestError("wrap unwraps angles given as inputs, such as crank_angle; times by a law have no jumps")
    elif inputs:
        raise RequestError(f"give times or inputs, not both: t and {listed(inputs)}")
    else:
        times, driven, axis = column_of("t", t), None, TIME
    chosen = _engine(engine, plan, bound, solver, tolerance, len(times))
    if driven is None:
        driven = without_huge_rates(chosen.drive(times, tuple(constants.values())))
    else:
        refuse_huge_rates(plan.drivers, driven)
    run = _run_of(plan, chosen, times, driven, out, constants).replaced(axis=axis)
    if anew_note and len(times):
        run = run.replaced(events=(Event(float(times[0]), "info", anew_note), *run.events))
    return run


def _settings(plan: SolvePlan, given: Mapping[str, float | str]) -> tuple[dict[str, float], dict[str, float | str]]:
    """Return law constants by name, those given in place of the file's, and the given parameters of the mechanism."""
    constants = {constant.name: constant.value for constant in plan.law_constants}
    quantities = {constant.name: constant.quantity for constant in plan.law_constants}
    positive = {constant.name for constant in plan.law_constants if constant.is_positive}
    geometry: dict[str, float | str] = {}
    for name, value in given.items():
        if name in plan.mechanism.parameters:
            geometry[name] = value
            continue
        known = [*plan.mechanism.parameters, *constants]
        if name not in constants:
            raise RequestError(f"parameter '{name}' is not known{suggestion(name, known)}; parameters: {listed(known)}")
        constants[name] = read_constant(f"parameter '{name}'", value, quantities[name], plan.mechanism.length_unit)
        if name in positive and not constants[name] > 0.0:
            raise RequestError(f"parameter '{name}' = {value!r} must be positive")
    return constants, geometry


def _with_settings(
    plan: SolvePlan,
    geometry: Mapping[str, float | str],
    constants: Mapping[str, float | str],
    tolerance: float,
    *,
    by_law: bool,
) -> tuple[SolvePlan, Vector, Solver | None, str]:
    """Set parameters of a plan.

    If continuation from the plan's anchor does not reach them, the mechanism is planned anew, as a file with these
    values would be.

    Returns:
        The plan, whose mechanism has the parameters; the values to bind (none: those of the plan); a solver if there is
        one already; and a note if continuation failed, else ''.

    """
    source = plan.mechanism
    settings = {**geometry, **constants}
    if not settings:
        return plan, (), None, ""
    changed = source.with_parameters(settings)
    if not geometry and (not by_law or law_starts(changed) == law_starts(source)):
        return plan, (), None, ""
    if any(source.parameters[name].expression is not None for name in geometry):
        followed = continued(source, settings)
        return compile_plan(followed.mechanism, plan.outputs), (), None, followed.message
    values = bound_values(plan, changed)
    solver = with_parameters(load_module(plan), values, tolerance)
    if by_law or isinstance(solver, UnsolvableModel):
        start = at_law_start(solver, changed)
        if not start.good:
            return compile_plan(changed, plan.outputs), (), None, anew(start.message)
    return replace(plan, mechanism=source.with_parameters(geometry)), values, solver, ""


def _engine(name: str, plan: SolvePlan, bound: Vector, solver: Solver | None, tolerance: float, count: int) -> Engine:
    """Return the engine of a name; `auto` is the native one if it pays and a compiler is found."""
    work = count * max(1, len(plan.blocks))
    if name == "native" or (name == "auto" and work >= WORTH_COMPILING):
        from kinfmu.sweep.native_engine import NativeEngine

        fixed = plan.fixed if solver is None else solver.model.FIXED
        try:
            return NativeEngine(plan, bound, fixed, tolerance)
        except CompilerError:
            if name == "native":
                raise
    return PythonEngine(solver or Solver(load_model(plan), tolerance))


def _run_of(
    plan: SolvePlan,
    engine: Engine,
    times: FloatArray,
    driven: Driven,
    out: Tables | None,
    constants: Mapping[str, float],
) -> Run:
    tables = _tables(out, (len(times), len(plan.outputs)), engine.order)
    result = engine.sweep(driven, tables)
    width = 3 * len(plan.drivers)  # value, speed, acceleration of each driver
    inputs = np.stack(driven, axis=2).reshape(len(times), width)
    return Run(
        t=times,
        outputs=plan.outputs,
        coordinate_count=plan.coordinate_count,
        values=tables[0],
        rates=tables[1],
        accelerations=tables[2],
        fixed=dict(zip(plan.fixed_nodes, engine.fixed.values(), strict=True)),
        input_names=tuple(name for driver in plan.drivers for name in driver.inputs),
        inputs=inputs,
        status=result.status,
        iterations=result.iterations,
        residual=result.residual,
        margin=result.margin,
        error=result.error,
        watch_names=plan.watch_names,
        watch=result.watch,
        length_unit=plan.mechanism.length_unit,
        mechanism_source=plan.mechanism,
        info={
            "name": plan.mechanism.name,
            "title": plan.mechanism.title,
            "engine": engine.name,
            **{name: repr(float(parameter.value)) for name, parameter in plan.mechanism.parameters.items()},
            **{name: repr(value) for name, value in constants.items()},
        },
        events=tuple(Event(float(times[k]), "error", message) for k, message in result.failures),
    )


def _tables(out: Tables | None, shape: tuple[int, int], order: Literal["C", "F"]) -> Tables:
    if out is None:
        return tuple(np.empty(shape, order=order) for _ in range(3))  # type: ignore[return-value]  # three of them
    for name, array in zip(("values", "rates", "accelerations"), out, strict=True):
        if array.shape != shape or array.dtype != np.float64:
            raise RequestError(f"out: {name} must be float64 of shape {shape}, not {array.dtype} of {array.shape}")
        if not array.flags.writeable:
            raise RequestError(f"out: {name} is read-only")
    return out
