"""The reading of many designs: part by part they are solved into tables of quantities and read, or read alone."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures import LowestMargin, PressureAngle, Reading
from kinfmu.mechanism.parameters import in_order, parameter_values
from kinfmu.mechanism.quantities.arithmetic import Value, atan2_like, cos, sin, sqrt
from kinfmu.mechanism.settings import LawConstant
from kinfmu.motion.breaks import has_breaks
from kinfmu.motion.extremes import Channels, Extremes, ExtremesReader, SamplesNeededError
from kinfmu.motion.history import FEWEST
from kinfmu.motion.measure import (
    listed_measures,
    moves_evenly,
    read_value,
    read_values,
    reason_without_value,
    with_measures,
)
from kinfmu.motion.motion import Motion
from kinfmu.motion.quantities import QuantityNames, QuantityRead, coordinates_behind, quantity_model
from kinfmu.motion.quintic import use_compiled
from kinfmu.motion.samples import driven_samples, is_crowded
from kinfmu.plan.equations.graph import Node, evaluate, symbols
from kinfmu.plan.plan import PlanParameter
from kinfmu.plan.trace import parameter_symbol
from kinfmu.processes import in_threads
from kinfmu.run.axis import TIME, axis_for
from kinfmu.run.designs import Batch, Driving, first_failure, parts_of, solve_alone, solve_by_library
from kinfmu.run.driving import numbers_of, refuse_both
from kinfmu.run.model import Model
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName, InputName, Quantity, unit_of

SAMPLES_AT_ONCE = 150_000  # of designs that are solved and measured together
SAMPLES_READ_AT_ONCE = 5_000_000  # of designs whose extremes are read in one call, which cannot be stopped

sin.register(np.ndarray, np.sin)
cos.register(np.ndarray, np.cos)
sqrt.register(np.ndarray, np.sqrt)


@atan2_like.register
def _(like: np.ndarray, y: Value, x: Value) -> FloatArray:  # noqa: ARG001
    return np.asarray(np.arctan2(y, x))


class SampledAxis(NamedTuple):
    """The samples of a motion without the motion: what its axis is made of, as in Run."""

    t: FloatArray
    axis: str
    input_names: tuple[InputName, ...]
    inputs: FloatArray
    length_unit: str


class _Solved(NamedTuple):
    """The designs of a part after they are solved.

    left: those to be assembled anew; reasons: why others are not reached, by number; worst: (m,) status; missing:
    (m, 2) how many samples of a design have no numbers, and the first of them; motion: of all; memory: to be used
    again.
    """

    left: Sequence[int]
    reasons: Mapping[int, str]
    worst: NDArray[np.int32]
    missing: NDArray[np.integer[Any]]
    motion: Motion
    memory: tuple[FloatArray, NDArray[np.int32]] | None = None


class BatchReading:
    """The measures of m designs, while they are read.

    Args: as in `measure_designs`.

    Attributes:
        parameters: Arrays (m,) or (1,) of what was given, by name.
        values: (m,) by the name of the measure.
        at: (m, k) by the name of the measure.
        status: (m,) worst status of the samples.
        reasons: Why a measure has no value, by design.
        motion: The motion of the samples, without numbers.

    """

    def __init__(
        self,
        model: Model,
        parameters: Mapping[str, ArrayLike | str],
        measures: Iterable[Reading | str] | None,
        t: ArrayLike | None,
        *,
        tolerance: float,
        anew: bool,
        inputs: Mapping[str, ArrayLike],
    ) -> None:
        refuse_both(t, inputs)
        if not isinstance(model, Model):
            raise RequestError(f"measure_designs needs a model, not {type(model).__name__}; kinfmu.compile gives one")
        mechanism = model.mechanism
        asked = None if measures is None else listed_measures(measures)
        self._measured = with_measures(mechanism, asked)
        self._readings = self._measured.measures
        if not self._readings:
            raise RequestError(f"there are no measures: {mechanism.name} declares none, or measures = []; give some")
        self._asked = dict(zip((one.name for one in self._readings), asked or mechanism.measures, strict=True))
        arrays = [numbers_of(name, value) for name, value in inputs.items()]
        self._batch = batch = Batch(model, parameters, max((len(row) for row in arrays if row.ndim == 2), default=1))
        self.parameters, self._count = batch.parameters, batch.count
        self._model, self._driving = model, batch.driving(t, inputs)
        if (count := len(self._driving.times)) < FEWEST:
            raise RequestError(f"there are {count} samples; measures need {FEWEST} or more")
        self._tolerance, self._anew = tolerance, anew
        self._channels: Channels | None = None
        self._idle: list[tuple[FloatArray, NDArray[np.int32]]] = []  # memory of earlier parts
        self._names = QuantityNames(mechanism)
        self.motion, self._order = self._empty_motion()
        by_design = self._names_by_design()
        self._by_design = [reading for reading in self._readings if reading.name in by_design]
        self._in_tables = [reading for reading in self._readings if reading.name not in by_design]
        self.units = self._units_of_parameters()
        self.values: dict[str, FloatArray] = {}
        self.at: dict[str, FloatArray] = {}
        for reading in self._readings:
            values = read_values(self.motion, reading)
            self.units[reading.name] = unit_of(values.quantity, mechanism.length_unit)
            self.values[reading.name] = np.full(self._count, np.nan)
            self.at[reading.name] = np.full((self._count, len(values.at)), np.nan)
        self.status = np.zeros(self._count, dtype=np.int32)
        self.reasons: dict[int, str] = {}

    @property
    def at_unit(self) -> str:
        """The unit of `at`."""
        return unit_of(self.motion.driver_quantity, self._model.mechanism.length_unit)

    def run(self, workers: int) -> None:
        """Solve and measure all designs."""
        samples = len(self._driving.times)
        self._is_native = self._model.is_native(self._count * samples)
        if self._in_tables:
            self._compute_quantities()
        most = SAMPLES_AT_ONCE if self._channels is None else SAMPLES_READ_AT_ONCE
        parts = parts_of(self._count, max(1, most // samples), workers)
        measure = self._measure if self._in_tables else self._measure_by_design
        reasons_of_parts = in_threads(measure, parts, workers if self._is_native else 1)
        for part, reasons in zip(parts, reasons_of_parts, strict=True):
            self.reasons |= {part.start + k: reason for k, reason in reasons.items()}

    def _compute_quantities(self) -> None:
        """Let the model compute the quantities that are read; Python, which divides by no 0, the coordinates behind."""
        read = self._names.quantities(*self._in_tables)
        self._computed = read if self._is_native else coordinates_behind(read)
        quantities = [one for one in self._computed if one not in self.motion.fixed]
        model = quantity_model(self._model, quantities)
        if self._is_native:
            use_compiled()
            model.load_library()
        self._quantities = self._batch.of_model(model)
        self.motion = replace(self.motion, outputs=quantities, _histories={})
        self._channels = self._wanted() if self._is_native else None

    def _wanted(self) -> Channels | None:
        """Return the extremes that the measures need; None if one needs more than extremes."""
        channels = Channels(self.motion.outputs)
        asked = replace(self.motion, extremes=Extremes(channels))
        try:
            for reading in self._in_tables:
                if (reading.begin, reading.end) != (None, None):
                    channels.windows.append((_window(asked.going_round(False), reading), _window(asked, reading)))
                read_values(asked, reading)
        except (SamplesNeededError, RequestError):  # an error is found again where samples are read
            return None
        return channels

    def _measure(self, part: slice) -> dict[int, str]:
        """Solve the designs of a part and measure them; return why one has no values, by its number in the part."""
        with np.errstate(all="ignore"):  # samples without numbers are NaN
            solved = (self._samples_of if self._channels is None else self._extremes_of)(part)
            missing, reasons = solved.missing[:, 0], solved.reasons
            is_solved = missing < len(self._driving.times)
            is_solved[list(solved.left)] = False
            self.status[part] = solved.worst
            reasons = {k: reasons[k] for k in np.flatnonzero(~is_solved).tolist() if k in reasons}
            for k in np.flatnonzero(is_solved).tolist() if self._by_design else ():
                if reason := self._measure_design(self._by_design, part.start + k):
                    reasons[k] = reason
            self._read(part, solved, is_solved, reasons)
            for k in solved.left:
                if reason := self._measure_design(self._readings, part.start + k):
                    reasons[k] = reason
        if solved.memory is not None:
            self._idle.append(solved.memory)
        return reasons

    def _extremes_of(self, part: slice) -> _Solved:
        """Solve the designs of a part and read the extremes of each, in compiled code."""
        assert self._channels is not None  # noqa: S101  the caller looks
        batch, driving = self._quantities.part(part), self._driving.part(part)
        reader = ExtremesReader(self._channels, self.motion.x, self._order, batch.count)
        left, reasons = solve_by_library(
            batch, driving, reader.tables, reader.status, self._tolerance, 1, anew=self._anew, reader=reader.function
        )
        motion = replace(self._motion_of(batch), extremes=reader.extremes())
        return _Solved(left, reasons, reader.worst, reader.missing, motion)

    def _samples_of(self, part: slice) -> _Solved:
        """Solve the designs of a part into tables."""
        batch, driving = self._quantities.part(part), self._driving.part(part)
        memory = self._idle.pop() if self._idle else None
        if memory is None or len(memory[1]) < batch.count:
            samples = len(driving.times)
            whole = np.empty((3, batch.count, len(self.motion.outputs), samples))
            memory = whole, np.empty((batch.count, samples), np.int32)
        tables, status = [table[: batch.count].transpose(0, 2, 1) for table in memory[0]], memory[1][: batch.count]
        left, reasons = self._solve(batch, driving, tables, status)
        good = status <= Status.BRIDGED
        missing = np.stack([np.count_nonzero(~good, axis=1), np.argmin(good, axis=1)], axis=1)
        value, rate, acceleration = (table[:, self._order] for table in tables)
        motion = replace(self._motion_of(batch), tables=(value, rate, acceleration))
        return _Solved(left, reasons, status.max(axis=1, initial=0), missing, motion, memory)

    def _solve(
        self, batch: Batch, driving: Driving, tables: Sequence[FloatArray], status: NDArray[np.int32]
    ) -> tuple[Sequence[int], dict[int, str]]:
        """Fill the tables; return the designs that are left to be assembled anew, and reasons of the others."""
        if self._is_native:
            return solve_by_library(batch, driving, tables, status, self._tolerance, 1, anew=self._anew)
        left, reasons = [], {}
        for k in range(batch.count):
            outcome = solve_alone(batch, driving, k, tables, status, self._tolerance, anew=False)
            if self._anew and not outcome.is_reached:
                left.append(k)
            elif outcome.reason:
                reasons[k] = outcome.reason
        return left, reasons

    def _read(
        self,
        part: slice,
        solved: _Solved,
        is_solved: NDArray[np.bool_],
        reasons: dict[int, str],
    ) -> None:
        """Read the measures of the designs of a part that are solved; add the reasons of those without values."""
        closed_ones: dict[tuple[QuantityRead, ...], NDArray[np.bool_]] = {}
        motion, is_whole = solved.motion, solved.missing[:, 0] == 0
        whole: dict[bool, Motion] = {}  # of all designs: measures of one quantity share its extremes
        for reading in self._in_tables:
            value, at = self.values[reading.name][part], self.at[reading.name][part]
            quantities = self._names.quantities(reading)
            if quantities not in closed_ones:
                closed_ones[quantities] = motion.goes_round(quantities, is_whole)
            for is_closed in (True, False):
                chosen = np.flatnonzero(is_solved & (closed_ones[quantities] == is_closed))
                if not len(chosen):
                    continue
                if len(chosen) < len(is_whole):
                    some = motion.of_designs(chosen).going_round(is_closed)
                else:
                    some = whole.setdefault(is_closed, motion.going_round(is_closed))
                try:
                    values = read_values(some, reading)
                except RequestError as error:
                    reasons |= {k: str(error) for k in chosen.tolist() if k not in reasons}
                    continue
                value[chosen] = values.value
                texts = np.broadcast_to(values.reason, len(chosen))
                for k in np.flatnonzero((texts != "") & is_whole[chosen]).tolist():
                    reasons.setdefault(int(chosen[k]), str(texts[k]))
                for column, places in enumerate(values.at):
                    at[chosen, column] = places
            for k in np.flatnonzero(is_solved & ~np.isfinite(value)).tolist():
                if k not in reasons:
                    reasons[k] = reason_without_value(self._samples(part.start + k), *solved.missing[k].tolist())

    def _measure_by_design(self, part: slice) -> dict[int, str]:
        """Measure the designs of a part one by one; return why one has no values, by its number in the part."""
        reasons = {k: self._measure_design(self._readings, part.start + k) for k in range(part.stop - part.start)}
        return {k: reason for k, reason in reasons.items() if reason}

    def _measure_design(self, readings: Sequence[Reading], design: int) -> str:
        """Read measures of one design, as `measure` does; return why one has no value."""
        parameters = self._batch.of(design)
        solved = partial(self._model.solve, parameters=parameters, tolerance=self._tolerance, anew=self._anew)
        try:
            run = solved(**self._driving.of(design))
        except KinfmuError as error:
            self.status[design] = Status.INCONSISTENT
            return str(error)
        self.status[design] = run.status.max(initial=0)
        if not run.good.any():
            return first_failure(run)
        is_of_samples = all(isinstance(reading, LowestMargin) for reading in readings)
        if is_of_samples and self._dependent.isdisjoint(reading.name for reading in readings):
            # They read the samples alone: the mechanism with these parameters, which takes milliseconds, is not needed.
            run = run.replaced(mechanism_source=self._model.mechanism)
        try:
            motion = Motion.of_run(run)
        except KinfmuError as error:
            return str(error)
        reasons = []
        for reading in readings:
            try:
                if reading.name in self._dependent:
                    (reading,) = with_measures(motion.mechanism, [self._asked[reading.name]]).measures
                result = read_value(run, motion, reading, solved)
            except KinfmuError as error:
                reasons.append(str(error))
                continue
            self.values[reading.name][design], self.at[reading.name][design] = result.value, result.at
            reasons += [result.reason] if result.reason else []
        return reasons[0] if reasons else ""

    def _motion_of(self, batch: Batch) -> Motion:
        """Return the motion of the designs of a part, without its tables."""
        motion = self.motion
        has_pressure = any(isinstance(reading, PressureAngle) for reading in self._in_tables)
        if self._open_parameters and (has_pressure or not self._is_native):
            arrays = {name: batch.parameters[name] for name in self._open_parameters}
            motion = replace(motion, points=points_of_designs(self._model.mechanism, arrays))
        return replace(
            motion,
            fixed={**motion.fixed, **self._fixed_of(batch)},
            is_closed=False,
            drive=motion.drive and replace(motion.drive, is_closed=False),
            _histories={},
        )

    @cached_property
    def _open_parameters(self) -> list[str]:
        """Names of the parameters of the geometry that are given."""
        return [name for name in self.parameters if name in self._model.parameters]

    def _fixed_of(self, batch: Batch) -> dict[CoordinateName, FloatArray]:
        """Return coordinates that a joint holds at a constant which differs between designs, (m, 1)."""
        names = [parameter_symbol(parameter.name) for parameter in self._model.plan.parameters]
        rows = batch.values.tolist() if self._open_constants else []
        constants = [evaluate(list(self._open_constants.values()), dict(zip(names, row, strict=True))) for row in rows]
        table = np.array(constants, dtype=float).reshape(len(rows), len(self._open_constants))
        return {name: table[:, k : k + 1] for k, name in enumerate(self._open_constants)}

    @cached_property
    def _open_constants(self) -> dict[CoordinateName, Node]:
        """Constant coordinates that are read and that depend on parameters which are given, as nodes."""
        opened = {parameter_symbol(name) for name in self._open_parameters}
        return {
            name: node
            for name, node in self._model.plan.fixed_nodes.items()
            if name in self._computed and opened.intersection(symbol.name for symbol in symbols([node]))
        }

    def _empty_motion(self) -> tuple[Motion, slice]:
        """Return a motion at the samples that goes round, with NaN for the first design, and the samples' order."""
        x, per, order, driver, drive = driven_samples(self._samples(0))
        needed = coordinates_behind(self._names.quantities(*self._readings))
        outputs = [name for name in self._model.outputs if name in needed]
        gap = np.full((len(x), len(outputs)), np.nan)
        fixed: Any = self._model.plan.fixed
        return Motion(
            mechanism=self._model.mechanism,
            x=x,
            per=per,
            tables=(gap, gap, gap),
            outputs=outputs,
            fixed=fixed,
            drive=replace(drive, is_closed=True) if drive else None,
            points=self._model.mechanism.body_points,
            driver=driver,
            is_closed=True,
        ), order

    def _samples(self, design: int) -> SampledAxis:
        """Return the samples of a design."""
        plan, (times, driven, _) = self._model.plan, self._driving
        names = tuple(name for driver in plan.drivers for name in driver.inputs)
        if driven is None:
            axis = TIME
            constants = self._batch.constants[design]
            drive = load_model(plan).drive
            table = np.array([drive(time, tuple(constants.tolist())) for time in times.tolist()], dtype=float)
            inputs = table.reshape(len(times), 3, len(plan.drivers)).transpose(0, 2, 1)
        else:
            tables = [table[design] if table.ndim == 3 else table for table in driven]
            axis, inputs = axis_for(tables[0], names[::3]), np.stack(tables, axis=2)
        return SampledAxis(times, axis, names, inputs.reshape(len(times), len(names)), plan.mechanism.length_unit)

    def _names_by_design(self) -> set[str]:
        """Return the names of measures that are read design by design: their numbers or samples differ."""
        plan, driven = self._model.plan, self._driving.driven
        names = {reading.name for reading in self._readings}
        if has_breaks(self._model.mechanism, over_time=driven is None) or is_crowded(self.motion.x):
            return names
        if driven is None:
            behind = {symbol.name for symbol in symbols([node for law in plan.laws for node in law[1:]])}
            if behind & ({parameter_symbol(name) for name in self._open_parameters} | set(self.parameters)):
                return names
        elif driven[0].ndim == 3:
            return names
        drive = self.motion.drive
        varies = drive is not None and not moves_evenly(drive)
        return self._dependent | {
            one.name
            for one in self._readings
            if not self._names.quantities(one) or (varies and one.compares_rates)  # margins and forces are samples
        }

    @cached_property
    def _dependent(self) -> set[str]:
        """Names of the measures whose own numbers depend on parameters that are given."""
        dependent = dependent_numbers(self._measured, self._open_parameters)
        return {str(place[1]) for place in dependent if place[0] == "measures"}

    def _units_of_parameters(self) -> dict[str, str]:
        """Return the units of the parameters and law constants that are given."""
        plan = self._model.plan
        arguments: list[PlanParameter | LawConstant] = [*plan.parameters, *plan.law_constants, *plan.load_constants]
        quantities = {argument.name: argument.quantity for argument in arguments}
        unit = plan.mechanism.length_unit
        return {name: unit_of(quantities[name] or Quantity("number"), unit) for name in self.parameters}


def _window(motion: Motion, reading: Reading) -> tuple[float, float] | None:
    """Return the part of a motion that a reading sees; None if the motion does not reach its ends."""
    try:
        return motion.part(reading.begin, reading.end).window
    except RequestError:
        return None


def points_of_designs(mechanism: Mechanism, given: Mapping[str, FloatArray]) -> dict[str, tuple[Value, Value]]:
    """Return body-fixed coordinates of every point by 'body.point'; (m, 1) those that differ between designs.

    mechanism: The mechanism as written. given: Arrays (m,) of parameters by name.
    """
    with np.errstate(all="ignore"):  # designs without a solution may have any numbers
        values = parameter_values(mechanism.parameters, {name: array[:, None] for name, array in given.items()})
        points: dict[str, tuple[Value, Value]] = dict(mechanism.body_points)
        for place in dependent_numbers(mechanism, given):
            if place[0] == "bodies" and place[2] == "points":
                body, point, axis = str(place[1]), str(place[3]), place[4]
                pair = list(points[f"{body}.{point}"])
                pair[int(axis)] = mechanism.expressions[place].value(values)
                points[f"{body}.{point}"] = pair[0], pair[1]
    return points


def dependent_numbers(mechanism: Mechanism, given: Collection[str]) -> list[tuple[str | int, ...]]:
    """Return the paths of the numbers that change with parameters, directly or through other parameters."""
    parameters = mechanism.parameters
    expressions = {name: p.expression for name, p in parameters.items() if p.expression and name not in given}
    changing = set(given)
    for name in in_order(parameters, expressions):
        if name in expressions and changing.intersection(expressions[name].names):
            changing.add(name)
    return [place for place, expression in mechanism.expressions.items() if changing.intersection(expression.names)]
