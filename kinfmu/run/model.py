"""Model: a mechanism that is planned and compiled once and then solved for many inputs and parameters."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model, load_module
from kinfmu.errors import CompilerError, RequestError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.settings import read_tolerance
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.efforts import load_inputs
from kinfmu.plan.forces import force_names
from kinfmu.plan.reactions import reaction_names_of
from kinfmu.processes import require_workers
from kinfmu.run import Event, Run
from kinfmu.run.arguments import Arguments, Setting, Settings
from kinfmu.run.axis import TIME, axis_for
from kinfmu.run.continued import anew as anew_note
from kinfmu.run.designs import Batch, Designs, solve_batch
from kinfmu.run.driving import (
    applied_efforts,
    driven_by_inputs,
    refuse_both,
    times_of,
    with_constants,
    without_huge_rates,
)
from kinfmu.run.engine import (
    Driven,
    Engine,
    PythonEngine,
    SweepResult,
    Tables,
    UnreachedError,
    require_engine,
    tables_for,
)
from kinfmu.run.forces import ForceModel, LoadedRun, force_plan
from kinfmu.run.sensitivities import Sensitivities, SensitivityModel, plan_of_unknowns
from kinfmu.solver.python import Solver, UnsolvableModel, with_parameters
from kinfmu.solver.python.pose import Vector
from kinfmu.solver.python.solver import TOLERANCE

WORTH_COMPILING = 300_000  # samples times blocks: Python needs a second or more for them
WORTH_LOADING = 10_000  # samples times blocks: Python needs as long for them as loading a compiled library takes
_SMALL = 1e-40  # 1 and this are 1, unless numbers are rounded up, down or to zero
_SOLVERS_KEPT = 8  # of the last parameters


def compile(  # noqa: A001  as re.compile
    mechanism: Mechanism,
    outputs: Sequence[str] | None = None,
    *,
    parameters: Sequence[str] | None = None,
    engine: str = "auto",
) -> Model:
    """Plan a mechanism once, for many calls with other inputs and other parameters.

    Args:
        mechanism: The mechanism.
        outputs: Names of the outputs to solve for; default: all. What they do not depend on is not solved.
            Columns keep the order of the mechanism.
        parameters: Names of the parameters that stay arguments; default: all that are not written as expressions. The
            others are numbers in the generated code, which is faster. One written as an expression can be named too.
        engine: 'python'; 'native', generated C, which is compiled now, or found in the cache; or 'auto', native where
            a call has enough samples to pay for compiling and a compiler is found.

    Returns:
        The model.

    Raises:
        RequestError: An output, a parameter or the engine is unknown.
        KinfmuError: The mechanism cannot be solved, as `compile_plan` reports it.
        CompilerError: The engine is 'native' and no compiler is found, or it fails.

    """
    require_mechanism(mechanism, "compile")
    require_engine(engine)
    model = Model(compile_plan(mechanism, outputs, parameters), engine)
    if engine == "native":
        model.load_library()
    return model


class Model:
    """A mechanism planned and compiled once; its parameters are arguments of every call.

    A model is safe to use from several threads, and can be sent to other processes, which plan it again and find the
    compiled library in the cache.

    Attributes:
        plan: What is solved, in which order.
        engine: 'auto', 'python' or 'native'.
        outputs: Names of the outputs.
        parameters: Names of the parameters that are arguments; law constants, such as 'crank.speed', are too.

    """

    def __init__(self, plan: SolvePlan, engine: str = "auto") -> None:
        self.plan = plan
        self.engine = engine
        self.outputs = plan.outputs
        self.parameters = tuple(parameter.name for parameter in plan.parameters)
        self.input_names = tuple(name for driver in plan.drivers for name in driver.inputs)
        self.watch_names = plan.watch_names
        self.force_names, self.reaction_names = force_names(plan.mechanism), reaction_names_of(plan.mechanism)
        self._load_inputs = load_inputs(plan)
        self.arguments = Arguments(plan)
        self._solver = lru_cache(maxsize=_SOLVERS_KEPT)(self._new_solver)

    def __repr__(self) -> str:
        arguments = f"; parameters: {listed(self.parameters)}" if self.parameters else ""
        return f"<Model of {self.plan.mechanism.name}: {', '.join(self.outputs)}{arguments}>"

    def __reduce__(self) -> tuple[Callable[..., Model], tuple[Any, ...]]:
        from kinfmu.mechanism import toml_text

        text = toml_text.text(self.plan.mechanism)
        return _from_text, (text, self.plan.outputs, self.parameters, self.engine)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism with the parameters as written."""
        return self.plan.mechanism

    def solve(
        self,
        t: ArrayLike | None = None,
        *,
        parameters: Settings | None = None,
        tolerance: float = TOLERANCE,
        wrap: bool = False,
        anew: bool = True,
        out: Tables | None = None,
        **inputs: ArrayLike,
    ) -> Run:
        """Solve positions, velocities and accelerations at times, or at driver values.

        Samples that cannot be reached are NaN with a status of 3 to 5 and an event with the reason; the run continues
        from the last good sample.

        Args:
            t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
            parameters: Values of parameters and law constants, such as {"crank_length": 0.2, "crank.speed": "30 rpm"}.
                Other geometry is reached by continuation from the pose of the geometry as written.
            tolerance: Residual relative to the size above which a sample is not ok; positive.
            wrap: Unwrap angles given as inputs: a jump from 2 pi to 0 goes on forwards. Without it such a jump turns
                back.
            anew: If continuation does not reach the parameters, assemble the mechanism anew from its start poses, as a
                file with these parameters is, with an event of level "info". False: that is an error.
            out: Three arrays (n, outputs) for values, rates and accelerations; by outputs (order="F") is faster.
            **inputs: Driver values in place of t, such as crank_angle=(n,) [rad] with crank_speed= and
                crank_acceleration=, arrays or numbers. Default speed: 1, default acceleration: 0, so that rates are per
                unit of the driver. The run's t then counts the samples, and its axis is the driver's value. With t or
                with these: efforts of external loads, such as wind_force= [N], arrays or numbers. Default: 0.

        Returns:
            The run, with a status for every sample. Margins, errors and forces are computed when they are first read.

        Raises:
            RequestError: A name is unknown or a value is invalid.
            MechanismError: A parameter has a value that the mechanism cannot have.
            KinfmuError: The parameters are not reached, and the mechanism cannot be assembled anew.
            CompilerError: The engine is 'native' and no compiler is found, or it fails.

        """
        tolerance = read_tolerance("tolerance", tolerance)
        setting = self.arguments.setting(parameters or {})
        efforts: dict[str, Any] = {name: inputs.pop(name) for name in self._load_inputs if name in inputs}
        times, driven = self._driving(t, inputs, wrap=wrap)
        count = len(times if driven is None else driven[0])
        try:
            engine = self._engine(count, setting, tolerance, by_law=driven is None)
            if driven is None:
                driven = without_huge_rates(engine.drive(times, setting.constants))
            tables = tables_for(out, (count, len(self.outputs)), engine.order)
            result = engine.sweep(driven, tables)
        except UnreachedError as reason:
            if not anew:
                raise
            return self._solve_anew(
                str(reason), setting.given, t, tolerance=tolerance, wrap=wrap, out=out, **inputs, **efforts
            )
        return SolvedSamples(
            self,
            setting,
            engine,
            times=None if inputs else times,
            inputs=inputs,
            efforts=applied_efforts(self._load_inputs, efforts, count),
            driven=driven,
            result=result,
            arguments={"t": t, "parameters": parameters, "tolerance": tolerance, "wrap": wrap, **inputs},
            is_kept=out is None,
        ).run(tables)

    def _driving(
        self, t: ArrayLike | None, inputs: Mapping[str, ArrayLike], *, wrap: bool
    ) -> tuple[FloatArray, Driven | None]:
        """Return times for the laws, or values, speeds and accelerations of the drivers by inputs."""
        if inputs:
            refuse_both(t, inputs)
            return np.empty(0), driven_by_inputs(self.plan.drivers, inputs, wrap=wrap)
        if wrap:
            raise RequestError("wrap unwraps angles given as inputs, such as crank_angle; times by a law have no jumps")
        return times_of(self.mechanism.run, t), None

    def solve_designs(
        self,
        parameters: Mapping[str, ArrayLike | str],
        t: ArrayLike | None = None,
        *,
        derivatives: int = 2,
        tolerance: float = TOLERANCE,
        anew: bool = True,
        workers: int = 1,
        **inputs: ArrayLike,
    ) -> Designs:
        """Solve the motions of many designs: sets of parameters, at the same times or driver values.

        Every design is solved as `solve` does it, sample by sample; with the native engine in one call of compiled
        code. What cannot be assembled or reached is NaN, with a status and a reason; it never ends the batch.

        Args:
            parameters: Arrays (m,) of parameters and law constants by name, one value for each design; numbers, and
                texts such as "30 rpm", hold for all.
            t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
            derivatives: Highest derivative wanted: 2 with accelerations, 1 with rates, 0 positions alone.
            tolerance: Residual relative to the size above which a sample is not ok; positive.
            anew: Assemble designs anew that continuation from the design as written does not reach, one after another:
                that takes milliseconds each, and longer for designs that do not close. False: they have no numbers.
            workers: Threads of the native engine; the Python engine has one.
            **inputs: Driver values in place of t, as in `solve`, the same for all designs (n,) or one row for each
                (m, n).

        Returns:
            The designs.

        Raises:
            RequestError: A name is unknown, or arrays have other lengths.
            CompilerError: The engine is 'native' and no compiler is found, or it fails.

        """
        tolerance = read_tolerance("tolerance", tolerance)
        if derivatives not in (0, 1, 2):
            raise RequestError(f"derivatives = {derivatives!r} must be 0, 1 or 2")
        require_workers(workers)
        refuse_both(t, inputs)
        batch = Batch(self, parameters)
        driving = batch.driving(t, inputs)
        native = workers if self.is_native(batch.count * len(driving.times)) else 0
        return solve_batch(batch, driving, highest=derivatives, tolerance=tolerance, anew=anew, threads=native)

    def sensitivities(
        self,
        t: ArrayLike | None = None,
        *,
        outputs: Sequence[str] | None = None,
        wrt: Sequence[str] | None = None,
        parameters: Settings | None = None,
        tolerance: float = TOLERANCE,
        wrap: bool = False,
        anew: bool = True,
        reuse: Sensitivities | None = None,
        **inputs: ArrayLike,
    ) -> Sensitivities:
        """Return exact derivatives of positions and rates with respect to parameters.

            J z_p = -Phi_p,   J zd_p = -(d/dp)(J zd + Phi_u ud)

        block after block, then outputs by the chain rule.

        Parameters change alone: times or driver values stay, and all that is written as an expression of a parameter
        changes with it. No difference quotients are involved.

        Args:
            t: (n,) times [s], as in `solve`.
            outputs: Names of outputs; default: all of the model.
            wrt: With respect to these: names of `parameters` of the model, and over time law constants, such as
                'crank.speed'; default: all of them.
            parameters: Values of parameters and law constants, as in `solve`.
            tolerance: As in `solve`.
            wrap: As in `solve`.
            anew: As in `solve`.
            reuse: An earlier result of this model that is no longer needed. If the names and the number of samples are
                the same, its arrays are overwritten, and read-only from then on: fresh memory costs as much as the
                numbers where there are thousands of samples.
            **inputs: Driver values in place of t, as in `solve`.

        Returns:
            Positions and rates (n, outputs) and their derivatives (n, outputs, parameters), with a status for every
            sample. Samples that are not reached are NaN; where samples are interpolated across a singular point, so are
            the derivatives with respect to parameters that remove it.

        Raises:
            RequestError: A name is unknown, a value is invalid, or the model has no parameters.
            KinfmuError: As in `solve`.

        """
        return self._sensitivity_model.solve(
            t, outputs, parameters, wrt, tolerance=tolerance, wrap=wrap, anew=anew, reuse=reuse, inputs=inputs
        )

    @cached_property
    def _sensitivity_model(self) -> SensitivityModel:
        plan = plan_of_unknowns(self.plan)
        return SensitivityModel(self, self if plan is self.plan else Model(plan, self.engine))

    @cached_property
    def force_model(self) -> ForceModel:
        """The forces of the model."""
        plan = force_plan(self.plan)
        return ForceModel(self if plan is self.plan else Model(plan, self.engine))

    def load_library(self) -> Any:
        """Return the compiled library of the plan, compiled now or found in the cache.

        Raises:
            CompilerError: There is no compiler, or the library cannot be compiled, cached or loaded.

        """
        return self._library

    @cached_property
    def _library(self) -> Any:
        from kinfmu.run.native_engine import Library

        return Library(self.plan)

    def by(self, engine: str) -> Model:
        """Return the model with another engine, with the same plan and the library, if it is loaded.

        Args:
            engine: 'python', 'native' or 'auto'.

        Returns:
            The model.

        """
        model = Model(self.plan, engine)
        model.__dict__ |= {name: value for name, value in self.__dict__.items() if name == "_library"}
        return model

    def is_native(self, count: int, *, if_cached: bool = False) -> bool:
        """Return whether `count` samples are solved by the native engine; its library is loaded then.

        Args:
            count: Number of samples.
            if_cached: True: also for fewer samples than pay for compiling, if the library is compiled already.

        Returns:
            True for C, False for Python.

        Raises:
            CompilerError: The engine is "native", and the library cannot be compiled.
            RequestError: The engine is "native", and the process does not round to nearest.

        """
        work = count * max(1, len(self.plan.blocks))
        is_ready = if_cached and work >= WORTH_LOADING and self.engine == "auto" and self._is_compiled()
        if self.engine == "python" or (self.engine == "auto" and work < WORTH_COMPILING and not is_ready):
            return False
        if 1.0 + _SMALL != 1.0 - _SMALL:  # the sines of C rely on it, those of Python do not
            if self.engine == "native":
                raise RequestError("engine 'native' needs rounding to nearest; call fesetround(FE_TONEAREST)")
            return False
        try:
            self.load_library()
        except CompilerError:
            if self.engine == "native":
                raise
            return False
        return True

    def _is_compiled(self) -> bool:
        from kinfmu.run.native_engine import is_cached

        return "_library" in self.__dict__ or is_cached(self.plan)

    def _engine(self, count: int, setting: Setting, tolerance: float, *, by_law: bool) -> Engine:
        """Return an engine with the parameters set."""
        start = self.mechanism.run.start if by_law and setting.starts_elsewhere else None
        if self.is_native(count):
            from kinfmu.run.native_engine import NativeEngine

            library = self._library
            if start is not None:
                library.require_start(setting.values or self.arguments.written, setting.constants, start, tolerance)
            return NativeEngine(library, setting.values, lambda: self.arguments.fixed(setting), tolerance)
        return PythonEngine(self._solver(setting.values, setting.constants if start is not None else None, tolerance))

    def _new_solver(self, values: Vector, starting: Vector | None, tolerance: float) -> Solver:
        """Return a solver with parameters set. starting: constants of laws whose start must be reached; None: none.

        Raise an UnreachedError if continuation does not reach the parameters, or the start of the laws.
        """
        if not values and starting is None:
            return Solver(load_model(self.plan), tolerance)
        solver = with_parameters(load_module(self.plan), values or self.arguments.written, tolerance)
        if isinstance(solver, UnsolvableModel):
            raise UnreachedError(solver.message)
        if starting is not None:
            pose = solver.solve(solver.anchor, solver.model.drive(self.mechanism.run.start, starting)[0])
            if not pose.good:
                raise UnreachedError(pose.message)
        return solver

    def _solve_anew(self, reason: str, given: Settings, t: ArrayLike | None, **arguments: Any) -> Run:
        """Solve the mechanism as a file with these parameters would be."""
        changed = self.mechanism.with_parameters(given)
        run = Model(compile_plan(changed, self.outputs), self.engine).solve(t, **arguments)
        note = Event(float(run.t[0]), "info", anew_note(reason)) if len(run.t) else None
        return run.replaced(events=(note, *run.events)) if note else run


def _from_text(text: str, outputs: Sequence[str], parameters: Sequence[str], engine: str) -> Model:
    """Return the model of a mechanism file's text: how models arrive in other processes."""
    from kinfmu.mechanism import toml_file

    mechanism = toml_file.parse(text, "the model's mechanism")
    return Model(compile_plan(mechanism, outputs, parameters), engine)


@dataclass(eq=False)
class SolvedSamples:
    """The solved samples of a model.

    Args:
        model: The model.
        setting: Parameters and law constants.
        engine: The engine with these.
        times: (n,) for the laws; None where inputs are given.
        inputs: Driver values in place of times, by name, as they were given.
        efforts: Of external loads, (n,) by their inputs.
        driven: Values, speeds and accelerations of the drivers, (n, d) each.
        result: Diagnostics of the samples.
        arguments: Of `Model.solve`, for these samples by another model.
        is_kept: False where the caller has the tables, which may hold other numbers by the time that forces are read.

    """

    model: Model
    setting: Setting
    engine: Engine
    times: FloatArray | None
    inputs: Mapping[str, Any]
    efforts: Mapping[str, FloatArray]
    driven: Driven
    result: SweepResult
    arguments: Mapping[str, Any]
    is_kept: bool

    def run(self, tables: Tables) -> Run:
        """Return the run; tables: values, rates and accelerations."""
        model, result = self.model, self.result
        plan, is_driven = model.plan, self.times is None
        has_forces, may_meet = bool(model.force_names), any(load.needs_direction for load in plan.mechanism.loads)
        run = Run.of_fields(
            t=self._numbers if is_driven else self.times,
            outputs=model.outputs,
            coordinate_count=plan.coordinate_count,
            values=tables[0],
            rates=tables[1],
            accelerations=tables[2],
            fixed=self._fixed,
            input_names=model.input_names,
            inputs=self._input_columns,
            status=result.status,
            iterations=result.iterations,
            residual=result.residual,
            margin=result.margin,
            error=result.error,
            watch_names=model.watch_names,
            watch=result.watch,
            force_names=model.force_names,
            forces=self._forces if has_forces else None,
            reaction_names=model.reaction_names,
            reactions=self._reactions if has_forces else None,
            shaking=self._shaking if has_forces else None,
            length_unit=plan.mechanism.length_unit,
            mechanism_source=model.arguments.mechanism_with(self.setting),
            info=self._info,
            events=self._events if may_meet else self._failures(),
            axis=self._axis if is_driven else TIME,
        )
        self._itself = weakref.ref(run)  # a run that refers to itself would keep its tables until they are collected
        return run

    def _numbers(self) -> FloatArray:
        return np.arange(len(self.driven[0]), dtype=float)

    def _fixed(self) -> Mapping[Any, float]:
        return dict(zip(self.model.plan.fixed_nodes, self.engine.fixed.values(), strict=True))

    def _input_columns(self) -> FloatArray:
        shape = len(self.model.input_names), len(self.driven[0])
        return np.stack([table.T for table in self.driven], axis=1).reshape(shape).T

    def _info(self) -> Mapping[str, str]:
        return self.model.arguments.info(self.setting, self.engine.name)

    def _axis(self) -> str:
        return axis_for(self.driven[0], self.model.input_names[::3])

    def _failures(self) -> tuple[Event, ...]:
        return self._as_events(self.result.failures, "error")

    def _events(self) -> tuple[Event, ...]:
        """Return failures, and warnings of loads whose ends meet."""
        meetings = self.model.force_model.meetings(self._loaded())
        return (*self._failures(), *self._as_events(meetings, "warning"))

    def _as_events(self, messages: Iterable[tuple[int, str]], level: str) -> tuple[Event, ...]:
        times = self.times
        return tuple(Event(float(k if times is None else times[k]), level, message) for k, message in messages)

    def _forces(self) -> FloatArray:
        return self.model.force_model.forces(self._loaded())

    def _reactions(self) -> FloatArray:
        return self.model.force_model.reactions(self._loaded())

    def _shaking(self) -> FloatArray:
        return self.model.force_model.shaking(self._loaded())

    def _loaded(self) -> LoadedRun:
        """Return what forces are computed from: the run itself, if it is kept and holds all that they need."""
        model, poses = self.model.force_model.poses, self._itself()
        driven = with_constants(self.model.plan.drivers, self.driven, self.inputs)
        has_gaps = bool(self.result.failures)
        if poses is None or model is not self.model or not self.is_kept:
            poses = model.solve(**self.arguments)
            driven, has_gaps = (poses.inputs[:, ::3], poses.inputs[:, 1::3], poses.inputs[:, 2::3]), True
        return LoadedRun(poses, driven, has_gaps, self.setting, self.efforts, self.times)
