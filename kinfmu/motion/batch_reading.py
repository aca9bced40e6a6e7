"""The reading of many designs: they are solved and measured part by part."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.codegen.python import load_model
from kinfmu.equations.graph import evaluate, symbols
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.mechanism.settings import LawConstant
from kinfmu.motion.design_points import dependent_numbers, points_of_designs
from kinfmu.motion.measure import chosen_measures, measure, reason_without_value
from kinfmu.motion.motion import Motion, argument_of
from kinfmu.motion.needed import needed
from kinfmu.motion.quintic import use_compiled
from kinfmu.motion.track import FEWEST, FloatArray, Track
from kinfmu.plan.plan import PlanParameter
from kinfmu.plan.trace import parameter_symbol
from kinfmu.readings import Finding, LowestMargin, Reading
from kinfmu.run.axis import TIME, axis_for
from kinfmu.sweep import Designs, Model
from kinfmu.sweep.designs import Batch, Driving, solve_batch
from kinfmu.sweep.driving import column_of, driven_by_inputs, run_times
from kinfmu.units import CoordinateName, InputName, Quantity, unit_of

SAMPLES_AT_ONCE = 50_000  # of designs that are solved and measured together


@dataclass(frozen=True, eq=False)
class Samples:
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
        mechanism = model.mechanism
        asked = [measures] if isinstance(measures, str) else None if measures is None else list(measures)
        self._readings = chosen_measures(mechanism, asked)
        self._asked = dict(zip((one.name for one in self._readings), asked or mechanism.measures, strict=True))
        batch = Batch(model, parameters)
        self.parameters, self._count = batch.parameters, batch.count
        driven = driven_by_inputs(model.plan.drivers, inputs, rows=batch.count) if inputs else None
        times = column_of("t", run_times(mechanism.run) if t is None else t)
        if driven is not None:
            times = np.arange(driven[0].shape[-2], dtype=float)
        if len(times) < FEWEST:
            raise RequestError(f"there are {len(times)} samples; measures need {FEWEST} or more")
        given = {name: np.asarray(value, dtype=float) for name, value in inputs.items()}
        self._model, self._driving = model, Driving(times, driven, given)
        self._tolerance, self._anew = tolerance, anew
        names = needed(mechanism, self._readings).coordinates
        self._columns = [k for k, name in enumerate(model.outputs) if name in names]
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
        size = max(1, SAMPLES_AT_ONCE // len(self._driving.times))
        parts = [slice(first, min(first + size, self._count)) for first in range(0, self._count, size)]
        is_native = self._model.is_native(self._count * len(self._driving.times))
        if is_native:
            use_compiled()
        if is_native and workers > 1:
            with ThreadPoolExecutor(workers) as pool:
                found = list(pool.map(lambda part: self._measure(part, 1), parts))
        else:
            found = [self._measure(part, int(is_native)) for part in parts]
        for part, reasons in zip(parts, found, strict=True):
            self.reasons |= {part.start + k: reason for k, reason in reasons.items()}

    def _measure(self, part: slice, threads: int) -> dict[int, str]:
        """Solve and measure the designs of a part; return the reasons of those without values, by number in it."""
        driving = self._driving
        if driving.driven is not None and driving.driven[0].ndim == 3:
            of_part = (driving.driven[0][part], driving.driven[1][part], driving.driven[2][part])
            inputs = {name: array[part] if array.ndim == 2 else array for name, array in driving.inputs.items()}
            driving = Driving(driving.times, of_part, inputs)
        parameters = {name: array if len(array) == 1 else array[part] for name, array in self.parameters.items()}
        count = part.stop - part.start
        batch = Batch(self._model, parameters, count)
        designs = solve_batch(batch, driving, highest=2, tolerance=self._tolerance, anew=self._anew, threads=threads)
        self.status[part] = designs.status.max(axis=1, initial=0)
        with np.errstate(all="ignore"):  # samples without numbers are NaN
            return self._read(part, batch, designs)

    def _read(self, part: slice, batch: Batch, designs: Designs) -> dict[int, str]:
        """Read the measures of a part."""
        good = designs.good
        is_solved = good.any(axis=1)
        reasons = {k: designs.reasons[k] for k in np.flatnonzero(~is_solved).tolist()}
        motion = self._motion_of(batch, designs)
        for reading in self._readings:
            value, at = self.values[reading.name][part], self.at[reading.name][part]
            if reading.name in self._alone:
                for k in np.flatnonzero(is_solved).tolist():
                    reason = self._read_one(reading.name, batch, k, part.start + k, value, at)
                    if reason:
                        reasons.setdefault(k, reason)
                continue
            closed = motion.goes_round(reading)
            for is_closed in (True, False):
                chosen = np.flatnonzero(is_solved & (closed == is_closed))
                if not len(chosen):
                    continue
                some = (motion if len(chosen) == len(good) else motion.of_designs(chosen)).going_round(is_closed)
                try:
                    found = self._found(reading, some)
                except RequestError as error:
                    reasons |= {k: str(error) for k in chosen.tolist() if k not in reasons}
                    continue
                value[chosen] = found.value
                for column, x in enumerate(found.at):
                    at[chosen, column] = some.driven_at(x)
            for k in np.flatnonzero(~np.isfinite(value)).tolist():
                if k not in reasons:
                    reasons[k] = reason_without_value(self._samples(part.start + k), good[k])
        return reasons

    def _read_one(self, name: str, batch: Batch, k: int, design: int, value: FloatArray, at: FloatArray) -> str:
        """Read a measure of one design, as `measure` does; return why it has no value."""
        inputs: dict[str, Any] = {
            key: array[design] if array.ndim == 2 else array for key, array in self._driving.inputs.items()
        }
        times = None if inputs else self._driving.times
        try:
            run = self._model.solve(times, parameters=batch.of(k), tolerance=self._tolerance, anew=self._anew, **inputs)
            found = measure(run, [self._asked[name]])[name]
        except KinfmuError as error:
            return str(error)
        value[k], at[k] = found.value, found.at
        return found.reason

    def _found(self, reading: Reading, motion: Motion) -> Finding:
        try:
            return reading.read(motion.part(reading.begin, reading.end))
        except RequestError as error:
            raise RequestError(f"[measures.{reading.name}]: {error}") from None

    def _motion_of(self, batch: Batch, designs: Designs) -> Motion:
        """Return the motion of the designs of a part."""
        mechanism = self._model.mechanism
        tables = [
            np.ascontiguousarray(table.transpose(0, 2, 1)[:, self._columns, self._order]).transpose(0, 2, 1)
            for table in (designs.values, designs.rates, designs.accelerations)
            if table is not None
        ]
        known = {name: batch.parameters[name] for name in self._open}
        return replace(
            self.motion,
            tables=(tables[0], tables[1], tables[2]),
            fixed={**self.motion.fixed, **self._fixed_of(batch)},
            points=points_of_designs(mechanism, known),
            is_closed=False,
            drive=replace(self.motion.drive, is_closed=False) if self.motion.drive else None,
            _tracks={},
        )

    @cached_property
    def _open(self) -> list[str]:
        """Names of the parameters of the geometry that are given."""
        return [name for name in self.parameters if name in self._model.parameters]

    def _fixed_of(self, batch: Batch) -> dict[CoordinateName, FloatArray]:
        """Return coordinates that a joint holds at a constant which differs between designs, (m, 1)."""
        plan = self._model.plan
        given = {parameter_symbol(name) for name in self._open}
        nodes = {
            name: node
            for name, node in plan.fixed_nodes.items()
            if given.intersection(symbol.name for symbol in symbols([node]))
        }
        names = [parameter_symbol(parameter.name) for parameter in plan.parameters]
        rows = [evaluate(list(nodes.values()), dict(zip(names, row, strict=True))) for row in batch.values.tolist()]
        table = np.array(rows, dtype=float).reshape(len(rows), len(nodes))
        return {name: table[:, k : k + 1] for k, name in enumerate(nodes)}

    def _empty_motion(self) -> tuple[Motion, slice]:
        """Return a motion at the samples that goes round, with NaN for the first design, and the samples' order."""
        plan, driving = self._model.plan, self._driving
        samples = self._samples(0)
        x, per = argument_of(samples)
        order = np.s_[:] if x[-1] > x[0] else np.s_[::-1]
        x = x[order]
        if not np.all(np.diff(x) > 0.0):
            raise RequestError("the samples are not in ascending or descending order")
        drive, driver = None, TIME
        if len(samples.input_names) == 3 or samples.axis != TIME:
            column = 0 if samples.axis == TIME else samples.input_names.index(samples.axis)
            driver = samples.input_names[column].driver
            u, ud, udd = (samples.inputs[order, column + k] for k in range(3))
            if per != "time":
                ud, udd = np.ones_like(x), np.zeros_like(x)
            drive = Track(x, u, ud, udd, is_closed=True)
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
            drive=drive,
            points=self._model.mechanism.body_points,
            driver=driver,
            margin=np.full(len(x), np.nan),
            is_closed=True,
        ), order

    def _samples(self, design: int) -> Samples:
        """Return the samples of a design."""
        plan, (times, driven, _) = self._model.plan, self._driving
        names = tuple(name for driver in plan.drivers for name in driver.inputs)
        if driven is None:
            axis = TIME
            constants = Batch(self._model, self.parameters).constants[design % self._count]
            drive = load_model(plan).drive
            table = np.array([drive(time, tuple(constants.tolist())) for time in times.tolist()], dtype=float)
            inputs = table.reshape(len(times), 3, len(plan.drivers)).transpose(0, 2, 1)
        else:
            one = [table[design] if table.ndim == 3 else table for table in driven]
            axis, inputs = axis_for(one[0], names[::3]), np.stack(one, axis=2)
        return Samples(times, axis, names, inputs.reshape(len(times), len(names)), plan.mechanism.length_unit)

    def _read_alone(self) -> set[str]:
        """Return the names of measures that are read design by design: their numbers or samples differ."""
        plan, driven = self._model.plan, self._driving.driven
        names = {reading.name for reading in self._readings}
        if driven is None:
            behind = {symbol.name for symbol in symbols([node for law in plan.laws for node in law[1:]])}
            given = {parameter_symbol(name) for name in self._open} | set(self.parameters)
            if behind & given:
                return names
        elif driven[0].ndim == 3:
            return names
        chosen = replace(self._model.mechanism, measures=self._readings)
        dependent = {place[1] for place in dependent_numbers(chosen, self._open) if place[0] == "measures"}
        return {
            reading.name for reading in self._readings if reading.name in dependent or isinstance(reading, LowestMargin)
        }

    def _units_of_parameters(self) -> dict[str, str]:
        """Return the units of the parameters and law constants that are given."""
        plan = self._model.plan
        known: list[PlanParameter | LawConstant] = [*plan.parameters, *plan.law_constants]
        quantities = {one.name: one.quantity for one in known}
        unit = plan.mechanism.length_unit
        return {name: unit_of(quantities[name] or Quantity("number"), unit) for name in self.parameters}
