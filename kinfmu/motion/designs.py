"""`measure_designs`: what designers read off the motions of many designs.

Part by part designs are solved into tables of quantities and read, or each is read alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinfmu.arrays import FloatArray
from kinfmu.display import Displayed
from kinfmu.errors import KinfmuError, RequestError, suggestion
from kinfmu.mechanism.measures import LowestMargin, PressureAngle, Reading
from kinfmu.mechanism.settings import LawConstant, read_tolerance
from kinfmu.motion.extremes import Channels, ExtremesReader
from kinfmu.motion.history import FEWEST
from kinfmu.motion.measure import (
    listed_measures,
    read_value,
    read_values,
    reason_without_value,
    with_measures,
)
from kinfmu.motion.motion import Motion
from kinfmu.motion.quantities import QuantityRead
from kinfmu.motion.reading_plan import measured_mechanism, points_of_designs, reading_plan, samples_of
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.plan import PlanParameter
from kinfmu.plan.trace import parameter_symbol
from kinfmu.processes import in_threads, require_workers
from kinfmu.run import Column
from kinfmu.run.designs import Batch, Driving, first_failure, parts_of, solve_alone, solve_by_library
from kinfmu.run.driving import numbers_of, refuse_both
from kinfmu.run.model import Model
from kinfmu.run.tables import Tabular
from kinfmu.solver.python.pose import Status
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.units import CoordinateName, Quantity, unit_of

SAMPLES_AT_ONCE = 150_000  # of designs that are solved and measured together
SAMPLES_READ_AT_ONCE = 5_000_000  # of designs whose extremes are read in one call, which cannot be stopped


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
        self._readings = (measured := measured_mechanism(model, asked)).measures
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
        self._idle: list[tuple[FloatArray, NDArray[np.int32]]] = []  # memory of earlier parts
        self._plan = reading_plan(model, asked, measured, batch, self._driving)
        self.motion = self._plan.motion
        self.units = self._units_of_parameters() | self._plan.units
        self.values = {reading.name: np.full(self._count, np.nan) for reading in self._readings}
        self.at = {name: np.full((self._count, count), np.nan) for name, count in self._plan.places.items()}
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
        self._channels: Channels | None = None
        if self._plan.in_tables:
            tables = self._plan.tables(self._model, is_native=self._is_native)
            self._constants, self.motion, self._channels = tables.constants, tables.motion, tables.channels
            self._quantities = self._batch.of_model(tables.model)
        most = SAMPLES_AT_ONCE if self._channels is None else SAMPLES_READ_AT_ONCE
        parts = parts_of(self._count, max(1, most // samples), workers)
        measure = self._measure if self._plan.in_tables else self._measure_by_design
        reasons_of_parts = in_threads(measure, parts, workers if self._is_native else 1)
        for part, reasons in zip(parts, reasons_of_parts, strict=True):
            self.reasons |= {part.start + k: reason for k, reason in reasons.items()}

    def _measure(self, part: slice) -> dict[int, str]:
        """Solve the designs of a part and measure them; return why one has no values, by its number in the part."""
        with np.errstate(all="ignore"):  # samples without numbers are NaN
            solved = (self._samples_of if self._channels is None else self._extremes_of)(part)
            missing, reasons = solved.missing[:, 0], solved.reasons
            is_solved = missing < len(self._driving.times)
            is_solved[list(solved.left)] = False
            self.status[part] = solved.worst
            reasons = {k: reasons[k] for k in np.flatnonzero(~is_solved).tolist() if k in reasons}
            for k in np.flatnonzero(is_solved).tolist() if self._plan.by_design else ():
                if reason := self._measure_design(self._plan.by_design, part.start + k):
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
        reader = ExtremesReader(self._channels, self.motion.x, self._plan.order, batch.count)
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
        value, rate, acceleration = (table[:, self._plan.order] for table in tables)
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
        for reading in self._plan.in_tables:
            value, at = self.values[reading.name][part], self.at[reading.name][part]
            quantities = self._plan.names.quantities(reading)
            if quantities not in closed_ones:
                closed_ones[quantities] = motion.goes_round(quantities, is_whole)
            for is_closed in (True, False):
                chosen = np.flatnonzero(is_solved & (closed_ones[quantities] == is_closed))
                if not len(chosen):
                    continue
                if len(chosen) < len(is_whole):
                    some = motion.of_designs(chosen).going_round(is_closed)
                else:
                    some = whole[is_closed] = whole.get(is_closed) or motion.going_round(is_closed)
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
                    reasons[k] = reason_without_value(
                        samples_of(self._batch, self._driving, part.start + k), *solved.missing[k].tolist()
                    )

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
        if is_of_samples and self._plan.dependent.isdisjoint(reading.name for reading in readings):
            # They read the samples alone: the mechanism with these parameters, which takes milliseconds, is not needed.
            run = run.replaced(mechanism_source=self._model.mechanism)
        try:
            motion = Motion.of_run(run)
        except KinfmuError as error:
            return str(error)
        reasons = []
        for reading in readings:
            try:
                if reading.name in self._plan.dependent:
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
        has_pressure = any(isinstance(reading, PressureAngle) for reading in self._plan.in_tables)
        if self._plan.open_parameters and (has_pressure or not self._is_native):
            arrays = {name: batch.parameters[name] for name in self._plan.open_parameters}
            motion = replace(motion, points=points_of_designs(self._model.mechanism, arrays))
        return replace(
            motion,
            fixed={**motion.fixed, **self._fixed_of(batch)},
            is_closed=False,
            drive=motion.drive and replace(motion.drive, is_closed=False),
            _histories={},
        )

    def _fixed_of(self, batch: Batch) -> dict[CoordinateName, FloatArray]:
        """Return coordinates that a joint holds at a constant which differs between designs, (m, 1)."""
        names = [parameter_symbol(parameter.name) for parameter in self._model.plan.parameters]
        nodes = self._constants
        rows = batch.values.tolist() if nodes else []
        constants = [evaluate(list(nodes.values()), dict(zip(names, row, strict=True))) for row in rows]
        table = np.array(constants, dtype=float).reshape(len(rows), len(nodes))
        return {name: table[:, k : k + 1] for k, name in enumerate(nodes)}

    def _units_of_parameters(self) -> dict[str, str]:
        """Return the units of the parameters and law constants that are given."""
        plan = self._model.plan
        arguments: list[PlanParameter | LawConstant] = [*plan.parameters, *plan.law_constants, *plan.load_constants]
        quantities = {argument.name: argument.quantity for argument in arguments}
        unit = plan.mechanism.length_unit
        return {name: unit_of(quantities[name] or Quantity("number"), unit) for name in self.parameters}


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignMeasures(Tabular, Displayed):
    """The measures of m designs, as columns of a table.

    Attributes:
        parameters: (m,) values of the parameters and law constants that were given, by name.
        values: (m,) values of the measures by name; NaN where a measure has none.
        at: (m, k) values of the driver where each measure occurs, by its name: k = 1 for an extreme, 2 for a range, a
            time ratio (smallest, largest) and a dwell (begin, end), 0 for a deviation.
        units: Units of parameters and measures, by name; '1' for a pure number.
        driver: The driver in whose values `at` is; 'time' if several move.
        at_unit: Unit of these.
        status: (m,) the worst status of a design's samples, as in Status.
        reasons: Why a measure of a design has no value (the first of them), by the number of the design.

    """

    parameters: Mapping[str, FloatArray]
    values: Mapping[str, FloatArray]
    at: Mapping[str, FloatArray]
    units: Mapping[str, str]
    driver: str
    at_unit: str
    status: NDArray[np.int32]
    reasons: Mapping[int, str]

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        return f"<{len(self)} designs, {int(self.good.sum())} of them with all measures; {', '.join(self.values)}>"

    @property
    def good(self) -> NDArray[np.bool_]:
        """(m,) True where all measures of a design have values."""
        return np.asarray(np.logical_and.reduce([np.isfinite(value) for value in self.values.values()]))

    def __getitem__(self, name: str) -> FloatArray:
        """Return the column (m,) of a measure or a parameter.

        Raises:
            KinfmuError: There is no such column.

        """
        if name in self.values:
            return self.values[name]
        if name in self.parameters:
            return self.parameters[name]
        known = (*self.values, *self.parameters)
        raise KinfmuError(f"the designs have no column '{name}'{suggestion(name, known)}")

    def columns(self) -> Iterator[Column]:
        """Yield parameters, measures with the driver values where they occur ('stroke.at', 'stroke.at2'), status."""
        for name, values in (*self.parameters.items(), *self.values.items()):
            yield Column(name, self.units[name], values)
            for k, at in enumerate(self.at[name].T if name in self.at else ()):
                yield Column(f"{name}.at{k + 1 if k else ''}", self.at_unit, at)
        yield Column("solver.status", "1", self.status)


def measure_designs(
    model: Model,
    parameters: Mapping[str, ArrayLike | str],
    measures: Iterable[Reading | str] | None = None,
    t: ArrayLike | None = None,
    *,
    workers: int = 1,
    tolerance: float = TOLERANCE,
    anew: bool = True,
    **inputs: ArrayLike,
) -> DesignMeasures:
    """Measure the motions of many designs: sets of parameters, at the same times or driver values.

    The values are those of `kinfmu.measure(model.solve(...))` for each design. The motions are solved and measured part
    by part, so that memory holds the measures alone. What cannot be assembled or reached is NaN with a status and a
    reason; it never ends the batch. Results do not depend on the number of workers.

    Args:
        model: The model, compiled with the outputs that the measures need, or with all.
        parameters: Arrays (m,) of parameters and law constants by name, one value for each design; numbers, and texts
            such as "30 rpm", hold for all.
        measures: Measures such as `kinfmu.measures.Range("stroke", of="slider.x")`, or names of those of the mechanism.
            Default: those of the mechanism.
        t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
        workers: Threads of the native engine; the Python engine has one.
        tolerance: Residual relative to the size above which a sample is not ok; positive.
        anew: Assemble designs anew that continuation from the design as written does not reach, as in `solve_designs`.
        **inputs: Driver values in place of t, as in `solve`, the same for all designs (n,) or one row for each (m, n).

    Returns:
        The measures.

    Raises:
        RequestError: A name is unknown, arrays have other lengths, or no motion at these samples can be measured.
        MechanismError: A measure is invalid.
        CompilerError: The engine is 'native' and no compiler is found, or it fails.

    """
    require_workers(workers)
    tolerance = read_tolerance("tolerance", tolerance)
    reading = BatchReading(model, parameters, measures, t, tolerance=tolerance, anew=anew, inputs=inputs)
    reading.run(workers)
    count = len(reading.status)
    return DesignMeasures(
        parameters={name: np.broadcast_to(array, count) for name, array in reading.parameters.items()},
        values=reading.values,
        at=reading.at,
        units=reading.units,
        driver=reading.motion.driver,
        at_unit=reading.at_unit,
        status=reading.status,
        reasons=dict(sorted(reading.reasons.items())),
    )
