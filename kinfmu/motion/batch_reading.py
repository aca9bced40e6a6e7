"""The reading of many designs: they are solved and measured part by part."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.mechanism.measures import Finding, LowestMargin, PressureAngle, Reading
from kinfmu.mechanism.settings import LawConstant
from kinfmu.motion.crowding import is_crowded
from kinfmu.motion.design_points import dependent_numbers, points_of_designs
from kinfmu.motion.driven_samples import driven_samples
from kinfmu.motion.geometry import moves_evenly
from kinfmu.motion.history import FEWEST
from kinfmu.motion.measure import (
    MeasuredValue,
    chosen_measures,
    known_values,
    listed_measures,
    read_value,
    reason_without_value,
    with_measures,
)
from kinfmu.motion.motion import Motion
from kinfmu.motion.needed import QuantityRead, needed
from kinfmu.motion.quantity_model import quantity_model
from kinfmu.motion.quintic import use_compiled
from kinfmu.motion.splitting import has_breaks
from kinfmu.plan.equations.graph import Node, evaluate, symbols
from kinfmu.plan.plan import PlanParameter
from kinfmu.plan.trace import parameter_symbol
from kinfmu.run import Run
from kinfmu.run.axis import TIME, axis_for
from kinfmu.run.designs import Batch, Driving, parts_of, solve_batch, solve_by_library
from kinfmu.run.driving import column_of, run_times
from kinfmu.run.model import Model
from kinfmu.run.numbers import numbers_of
from kinfmu.solver.python.status import Status
from kinfmu.units import CoordinateName, InputName, Quantity, unit_of

SAMPLES_AT_ONCE = 150_000  # of designs that are solved and measured together


@dataclass(frozen=True, eq=False)
class SampledAxis:
    """The samples of a motion without the motion: what its axis is made of, as in Run."""

    t: FloatArray
    axis: str
    input_names: tuple[InputName, ...]
    inputs: FloatArray
    length_unit: str


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
        if inputs and t is not None:
            raise RequestError(f"give times or inputs, not both: t and {listed(inputs)}")
        if not isinstance(model, Model):
            raise RequestError(f"measure_designs needs a model, not {type(model).__name__}; kinfmu.compile gives one")
        mechanism = model.mechanism
        asked = None if measures is None else listed_measures(measures)
        self._measured = with_measures(mechanism, asked)
        self._readings = self._measured.measures
        if not self._readings:
            raise RequestError(f"there are no measures: {mechanism.name} declares none, or measures = []; give some")
        self._asked = dict(zip((one.name for one in self._readings), asked or mechanism.measures, strict=True))
        given = {name: numbers_of(name, value) for name, value in inputs.items()}
        rows = max((len(array) for array in given.values() if array.ndim == 2), default=1)
        self._batch = batch = Batch(model, parameters, rows)
        self.parameters, self._count = batch.parameters, batch.count
        driven = batch.driven(inputs)
        times = column_of("t", run_times(mechanism.run) if t is None else t)
        if driven is not None:
            times = np.arange(driven[0].shape[-2], dtype=float)
        if len(times) < FEWEST:
            raise RequestError(f"there are {len(times)} samples; measures need {FEWEST} or more")
        self._model, self._driving = model, Driving(times, driven, given)
        self._tolerance, self._anew = tolerance, anew
        self._needed = needed(mechanism, self._readings)
        self._quantities = {reading.name: needed(mechanism, [reading]).quantities for reading in self._readings}
        self._columns = [k for k, name in enumerate(model.outputs) if name in self._needed.coordinates]
        self._idle: list[tuple[FloatArray, NDArray[np.int32]]] = []  # memory of earlier parts
        self.motion, self._order = self._empty_motion()
        self._alone = self._read_alone()
        self.units = self._units_of_parameters()
        self.values: dict[str, FloatArray] = {}
        self.at: dict[str, FloatArray] = {}
        for reading in self._readings:
            found = self._found(reading, self.motion)
            self.units[reading.name] = unit_of(found.quantity, mechanism.length_unit)
            self.values[reading.name] = np.full(self._count, np.nan)
            self.at[reading.name] = np.full((self._count, len(found.at)), np.nan)
        self.status = np.zeros(self._count, dtype=np.int32)
        self.reasons: dict[int, str] = {}

    @property
    def at_unit(self) -> str:
        """The unit of `at`."""
        return unit_of(self.motion.driver_quantity, self._model.mechanism.length_unit)

    def run(self, workers: int) -> None:
        """Solve and measure all designs."""
        parts = parts_of(self._count, max(1, SAMPLES_AT_ONCE // len(self._driving.times)), workers)
        is_native = self._model.is_native(self._count * len(self._driving.times))
        if not is_native or not self._needed.quantities:
            found = [self._measure(part) for part in parts]
        elif self._prepare_compiled() and workers > 1:
            with ThreadPoolExecutor(workers) as pool:
                found = list(pool.map(self._measure_compiled, parts))
        else:
            found = [self._measure_compiled(part) for part in parts]
        for part, reasons in zip(parts, found, strict=True):
            self.reasons |= {part.start + k: reason for k, reason in reasons.items()}

    def _prepare_compiled(self) -> bool:
        """Compile the quantities that are read; True."""
        use_compiled()
        quantities = [one for one in self._needed.quantities if one not in self.motion.fixed]
        model, names = quantity_model(self._model, quantities)
        model.load_library()
        self._compiled = Batch(model, self.parameters, self._count)
        self._count_kept = len(quantities)
        self.motion = replace(self.motion, outputs=model.outputs, computed=names, _histories={})
        return True

    def _measure_compiled(self, part: slice) -> dict[int, str]:
        """Solve and measure the designs of a part by compiled code; return reasons as `_measure` does."""
        batch, driving = self._compiled.part(part), self._driving_of(part)
        shape = (batch.count, self._count_kept, len(driving.times))
        kept = self._idle.pop() if self._idle else (np.empty((3, *shape)), np.empty((shape[0], shape[2]), np.int32))
        if len(kept[1]) < batch.count:
            kept = (np.empty((3, *shape)), np.empty((shape[0], shape[2]), np.int32))
        tables, status = [table[: batch.count].transpose(0, 2, 1) for table in kept[0]], kept[1][: batch.count]
        with np.errstate(all="ignore"):  # samples without numbers are NaN
            alone, found = solve_by_library(batch, driving, tables, status, self._tolerance, 1, anew=self._anew)
            good = np.asarray(status <= Status.BRIDGED)
            is_solved = np.asarray(good.any(axis=1))
            is_solved[list(alone)] = False
            self.status[part] = status.max(axis=1, initial=0)
            reasons = {k: found[k] for k in np.flatnonzero(~is_solved).tolist() if k in found}
            motion = self._motion_of(batch, [table[:, self._order] for table in tables])
            self._read(part, batch, motion, good, is_solved, reasons)
            for k in alone:
                reason = self._read_one(self._readings, batch, k, part.start + k)
                if reason:
                    reasons[k] = reason
        self._idle.append(kept)
        return reasons

    def _measure(self, part: slice) -> dict[int, str]:
        """Solve and measure the designs of a part; return the reasons of those without values, by number in it."""
        batch = self._batch.part(part)
        designs = solve_batch(
            batch, self._driving_of(part), highest=2, tolerance=self._tolerance, anew=self._anew, threads=0
        )
        self.status[part] = designs.status.max(axis=1, initial=0)
        is_solved = np.asarray(designs.good.any(axis=1))
        reasons = {k: designs.reasons[k] for k in np.flatnonzero(~is_solved).tolist()}
        tables = [
            np.ascontiguousarray(table.transpose(0, 2, 1)[:, self._columns, self._order]).transpose(0, 2, 1)
            for table in (designs.values, designs.rates, designs.accelerations)
            if table is not None
        ]
        with np.errstate(all="ignore"):  # samples without numbers are NaN
            self._read(part, batch, self._motion_of(batch, tables), designs.good, is_solved, reasons)
        return reasons

    def _driving_of(self, part: slice) -> Driving:
        """Return what moves the designs of a part."""
        times, driven, given = self._driving
        inputs = {name: array[part] if array.ndim == 2 else array for name, array in given.items()}
        if driven is not None and driven[0].ndim == 3:
            driven = (driven[0][part], driven[1][part], driven[2][part])
        return Driving(
            times, driven, {name: array[part] if array.ndim == 2 else array for name, array in inputs.items()}
        )

    def _read(
        self,
        part: slice,
        batch: Batch,
        motion: Motion,
        good: NDArray[np.bool_],
        is_solved: NDArray[np.bool_],
        reasons: dict[int, str],
    ) -> None:
        """Read the measures of the designs of a part that are solved; add the reasons of those without values."""
        alone = [reading for reading in self._readings if reading.name in self._alone]
        for k in np.flatnonzero(is_solved).tolist() if alone else ():
            reason = self._read_one(alone, batch, k, part.start + k)
            if reason:
                reasons.setdefault(k, reason)
        closed_ones: dict[tuple[QuantityRead, ...], NDArray[np.bool_]] = {}
        is_whole = np.asarray(good.all(axis=1))
        whole: dict[bool, Motion] = {}  # of all designs: measures of one quantity share its extremes
        for reading in self._readings:
            value, at = self.values[reading.name][part], self.at[reading.name][part]
            if reading.name in self._alone:
                continue
            quantities = self._quantities[reading.name]
            if quantities not in closed_ones:
                closed_ones[quantities] = motion.goes_round(quantities, is_whole)
            for is_closed in (True, False):
                is_chosen = is_solved & (closed_ones[quantities] == is_closed)
                if not is_chosen.any():
                    continue
                chosen = np.flatnonzero(is_chosen)
                if len(chosen) < len(good):
                    some = motion.of_designs(chosen).going_round(is_closed)
                else:
                    some = whole.setdefault(is_closed, motion.going_round(is_closed))
                try:
                    found = self._found(reading, some)
                except RequestError as error:
                    reasons |= {k: str(error) for k in chosen.tolist() if k not in reasons}
                    continue
                value[chosen], lack = known_values(found)
                for k, text in zip(chosen.tolist(), np.broadcast_to(lack, len(chosen)).tolist(), strict=True):
                    if text and good[k].all():
                        reasons.setdefault(k, text)
                for column, x in enumerate(found.at):
                    at[chosen, column] = some.driven_at(x)
            for k in np.flatnonzero(is_solved & ~np.isfinite(value)).tolist():
                if k not in reasons:
                    reasons[k] = reason_without_value(self._samples(part.start + k), good[k])

    def _read_one(self, readings: Sequence[Reading], batch: Batch, k: int, design: int) -> str:
        """Read measures of one design, as `measure` does; return why one has no value."""
        given = self._driving.inputs
        inputs: dict[str, Any] = {key: array[design] if array.ndim == 2 else array for key, array in given.items()}
        times = None if inputs else self._driving.times
        try:
            run = self._model.solve(times, parameters=batch.of(k), tolerance=self._tolerance, anew=self._anew, **inputs)
        except KinfmuError as error:
            self.status[design] = Status.INCONSISTENT
            return str(error)
        self.status[design] = run.status.max(initial=0)
        margins = [reading for reading in readings if isinstance(reading, LowestMargin)]
        if len(margins) == len(readings) and self._dependent.isdisjoint(reading.name for reading in readings):
            # They read the samples alone: the mechanism with these parameters, which takes milliseconds, is not needed.
            run = run.replaced(mechanism_source=self._model.mechanism)
        try:
            motion = Motion.of_run(run, with_margin=bool(margins))
        except KinfmuError as error:
            return str(error)
        reasons = []
        for reading in readings:
            try:
                found = self._value_of(run, motion, reading, batch.of(k))
            except KinfmuError as error:
                reasons.append(str(error))
                continue
            self.values[reading.name][design], self.at[reading.name][design] = found.value, found.at
            reasons += [found.reason] if found.reason else []
        return reasons[0] if reasons else ""

    def _value_of(self, run: Run, motion: Motion, reading: Reading, parameters: Mapping[str, float]) -> MeasuredValue:
        """Return a measure of one design, as `measure` does."""
        if reading.name in self._dependent:
            (reading,) = chosen_measures(motion.mechanism, [self._asked[reading.name]])
        solved = partial(self._model.solve, parameters=parameters, tolerance=self._tolerance, anew=self._anew)
        return read_value(run, motion, reading, solved)

    def _found(self, reading: Reading, motion: Motion) -> Finding:
        try:
            return reading.read(motion.part(reading.begin, reading.end))
        except RequestError as error:
            raise RequestError(f"[measures.{reading.name}]: {error}") from None

    def _motion_of(self, batch: Batch, tables: Sequence[FloatArray]) -> Motion:
        """Return the motion of the designs of a part."""
        motion = self.motion
        places_bodies = not motion.computed or any(isinstance(one, PressureAngle) for one in self._readings)
        if self._open and places_bodies:
            given = {name: batch.parameters[name] for name in self._open}
            motion = replace(motion, points=points_of_designs(self._model.mechanism, given))
        fixed = {**motion.fixed, **self._fixed_of(batch)}
        drive = motion.drive and replace(motion.drive, is_closed=False)
        return replace(
            motion, tables=(tables[0], tables[1], tables[2]), fixed=fixed, is_closed=False, drive=drive, _histories={}
        )

    @cached_property
    def _open(self) -> list[str]:
        """Names of the parameters of the geometry that are given."""
        return [name for name in self.parameters if name in self._model.parameters]

    def _fixed_of(self, batch: Batch) -> dict[CoordinateName, FloatArray]:
        """Return coordinates that a joint holds at a constant which differs between designs, (m, 1)."""
        names = [parameter_symbol(parameter.name) for parameter in self._model.plan.parameters]
        rows = batch.values.tolist() if self._open_fixed else []
        found = [evaluate(list(self._open_fixed.values()), dict(zip(names, row, strict=True))) for row in rows]
        table = np.array(found, dtype=float).reshape(len(found), len(self._open_fixed))
        return {name: table[:, k : k + 1] for k, name in enumerate(self._open_fixed)}

    @cached_property
    def _open_fixed(self) -> dict[CoordinateName, Node]:
        """Constant coordinates that are read and that depend on parameters which are given, as nodes."""
        given = {parameter_symbol(name) for name in self._open}
        read = self._needed.quantities if self.motion.computed else self._needed.coordinates
        return {
            name: node
            for name, node in self._model.plan.fixed_nodes.items()
            if name in read and given.intersection(symbol.name for symbol in symbols([node]))
        }

    def _empty_motion(self) -> tuple[Motion, slice]:
        """Return a motion at the samples that goes round, with NaN for the first design, and the samples' order."""
        plan, driving = self._model.plan, self._driving
        samples = self._samples(0)
        x, per, order, driver, drive = driven_samples(samples)
        outputs = [self._model.outputs[k] for k in self._columns]
        gap = np.full((len(driving.times), len(outputs)), np.nan)
        fixed: Any = plan.fixed
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
            margin=np.full(len(x), np.nan),
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
            one = [table[design] if table.ndim == 3 else table for table in driven]
            axis, inputs = axis_for(one[0], names[::3]), np.stack(one, axis=2)
        return SampledAxis(times, axis, names, inputs.reshape(len(times), len(names)), plan.mechanism.length_unit)

    def _read_alone(self) -> set[str]:
        """Return the names of measures that are read design by design: their numbers or samples differ."""
        plan, driven = self._model.plan, self._driving.driven
        names = {reading.name for reading in self._readings}
        if has_breaks(self._model.mechanism, over_time=driven is None) or is_crowded(self.motion.x):
            return names
        if driven is None:
            behind = {symbol.name for symbol in symbols([node for law in plan.laws for node in law[1:]])}
            given = {parameter_symbol(name) for name in self._open} | set(self.parameters)
            if behind & given:
                return names
        elif driven[0].ndim == 3:
            return names
        drive = self.motion.drive
        varies = drive is not None and not moves_evenly(drive)
        forces = measured_forces(self._model.mechanism)
        return self._dependent | {
            one.name
            for one in self._readings
            if isinstance(one, LowestMargin) or getattr(one, "of", None) in forces or (varies and one.compares_rates)
        }

    @cached_property
    def _dependent(self) -> set[str]:
        """Names of the measures whose own numbers depend on parameters that are given."""
        dependent = dependent_numbers(self._measured, self._open)
        return {str(place[1]) for place in dependent if place[0] == "measures"}

    def _units_of_parameters(self) -> dict[str, str]:
        """Return the units of the parameters and law constants that are given."""
        plan = self._model.plan
        known: list[PlanParameter | LawConstant] = [*plan.parameters, *plan.law_constants, *plan.load_constants]
        quantities = {one.name: one.quantity for one in known}
        unit = plan.mechanism.length_unit
        return {name: unit_of(quantities[name] or Quantity("number"), unit) for name in self.parameters}
