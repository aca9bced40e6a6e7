"""How many designs are read: what measures of a model need at some samples, which calls for the same have in common."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.parameters import parameter_values, parameters_behind
from kinfmu.mechanism.quantities.arithmetic import Value, atan2_like, cos, sin, sqrt
from kinfmu.motion.breaks import has_breaks
from kinfmu.motion.extremes import Channels, Extremes, SamplesNeededError
from kinfmu.motion.measure import moves_evenly, read_values, with_measures
from kinfmu.motion.motion import Motion
from kinfmu.motion.quantities import QuantityNames, QuantityRead, coordinates_behind, quantity_model
from kinfmu.motion.quintic import use_compiled
from kinfmu.motion.samples import driven_samples, is_crowded
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.trace import parameter_symbol
from kinfmu.run.axis import TIME, axis_for
from kinfmu.run.designs import Batch, Driving
from kinfmu.run.model import Model
from kinfmu.units import CoordinateName, InputName, unit_of

T = TypeVar("T")

_MOST_KEPT = 8  # of each model: optimizers ask for the same measures again and again
_measured: WeakKeyDictionary[Model, dict[Hashable, Mechanism]] = WeakKeyDictionary()
_plans: WeakKeyDictionary[Model, dict[Hashable, ReadingPlan]] = WeakKeyDictionary()

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


class QuantityTables(NamedTuple):
    """How quantities are computed that measures read in tables.

    constants: Constant coordinates among them that depend on parameters which are given, as nodes; model: what computes
    those that move; motion: the samples, with these as outputs; channels: the extremes that are read in compiled code;
    None: samples are read.
    """

    constants: dict[CoordinateName, Node]
    model: Model
    motion: Motion
    channels: Channels | None


class ReadingPlan:
    """How the measures of designs are read at some samples.

    Args:
        model: The model.
        measured: Its mechanism with the measures.
        batch: Designs; of others only values of parameters differ.
        driving: What moves them.

    Attributes:
        motion: The motion of the samples, without numbers.
        order: The order of the samples in the motion.
        in_tables: Measures of quantities that a model computes for all designs.
        by_design: The others, which are read design by design.
        open_parameters: Names of the parameters of the geometry that are given.
        names: Of quantities.
        units: Of the measures, by name.
        places: How many values of the driver state where a measure occurs, by name.

    """

    def __init__(self, model: Model, measured: Mechanism, batch: Batch, driving: Driving) -> None:
        self._plan, self._measured = model.plan, measured  # no model: models are kept as long as they are used
        self._given, self._driven = tuple(batch.parameters), driving.driven
        self.open_parameters = [name for name in self._given if name in model.parameters]
        self.names = QuantityNames(model.mechanism)
        self.motion, self.order = self._empty_motion(samples_of(batch, driving, 0), model.outputs)
        by_design = self._names_by_design()
        self.by_design = [reading for reading in measured.measures if reading.name in by_design]
        self.in_tables = [reading for reading in measured.measures if reading.name not in by_design]
        self.units: dict[str, str] = {}
        self.places: dict[str, int] = {}
        for reading in measured.measures:
            values = read_values(self.motion, reading)
            self.units[reading.name] = unit_of(values.quantity, model.mechanism.length_unit)
            self.places[reading.name] = len(values.at)
        self._tables: dict[bool, QuantityTables] = {}

    def tables(self, model: Model, *, is_native: bool) -> QuantityTables:
        """Return how quantities are computed; Python, which divides by no 0, computes the coordinates behind."""
        if is_native not in self._tables:
            self._tables[is_native] = self._new_tables(model, is_native=is_native)
        return self._tables[is_native]

    def _new_tables(self, model: Model, *, is_native: bool) -> QuantityTables:
        read = self.names.quantities(*self.in_tables)
        computed = read if is_native else coordinates_behind(read)
        quantities = [one for one in computed if one not in self.motion.fixed]
        of_quantities = quantity_model(model, quantities)
        if is_native:
            use_compiled()
            of_quantities.load_library()
        motion = replace(self.motion, outputs=quantities, _histories={})
        channels = self._wanted(motion) if is_native else None
        return QuantityTables(self._open_constants(computed), of_quantities, motion, channels)

    def _wanted(self, motion: Motion) -> Channels | None:
        """Return the extremes that the measures need; None if one needs more than extremes."""
        channels = Channels(motion.outputs)
        asked = replace(motion, extremes=Extremes(channels))
        try:
            for reading in self.in_tables:
                if (reading.begin, reading.end) != (None, None):
                    channels.windows.append((_window(asked.going_round(False), reading), _window(asked, reading)))
                read_values(asked, reading)
        except (SamplesNeededError, RequestError):  # an error is found again where samples are read
            return None
        return channels

    def _open_constants(self, computed: Collection[QuantityRead]) -> dict[CoordinateName, Node]:
        """Return constant coordinates among quantities that depend on parameters which are given, as nodes."""
        opened = {parameter_symbol(name) for name in self.open_parameters}
        return {
            name: node
            for name, node in self._plan.fixed_nodes.items()
            if name in computed and opened.intersection(symbol.name for symbol in symbols([node]))
        }

    def _empty_motion(self, samples: SampledAxis, outputs: Sequence[CoordinateName]) -> tuple[Motion, slice]:
        """Return a motion at the samples that goes round, with NaN for the first design, and the samples' order."""
        x, per, order, driver, drive = driven_samples(samples)
        needed = coordinates_behind(self.names.quantities(*self._measured.measures))
        read = [name for name in outputs if name in needed]
        gap = np.full((len(x), len(read)), np.nan)
        fixed: Any = self._plan.fixed
        return Motion(
            mechanism=self._plan.mechanism,
            x=x,
            per=per,
            tables=(gap, gap, gap),
            outputs=read,
            fixed=fixed,
            drive=replace(drive, is_closed=True) if drive else None,
            points=self._plan.mechanism.body_points,
            driver=driver,
            is_closed=True,
        ), order

    def _names_by_design(self) -> set[str]:
        """Return the names of measures that are read design by design: their numbers or samples differ."""
        plan, driven = self._plan, self._driven
        names = {reading.name for reading in self._measured.measures}
        if has_breaks(plan.mechanism, over_time=driven is None) or is_crowded(self.motion.x):
            return names
        if driven is None:
            behind = {symbol.name for symbol in symbols([node for law in plan.laws for node in law[1:]])}
            if behind & ({parameter_symbol(name) for name in self.open_parameters} | set(self._given)):
                return names
        elif driven[0].ndim == 3:
            return names
        drive = self.motion.drive
        varies = drive is not None and not moves_evenly(drive)
        return self.dependent | {
            one.name
            for one in self._measured.measures
            if not self.names.quantities(one) or (varies and one.compares_rates)  # margins and forces are samples
        }

    @cached_property
    def dependent(self) -> set[str]:
        """Names of the measures whose own numbers depend on parameters that are given."""
        dependent = dependent_numbers(self._measured, self.open_parameters)
        return {str(place[1]) for place in dependent if place[0] == "measures"}


def measured_mechanism(model: Model, asked: Sequence[Reading | str] | None) -> Mechanism:
    """Return the mechanism of a model with the measures of a call, as `with_measures` does."""
    if asked is None:
        return model.mechanism
    # The texts tell numbers apart that are equal, such as 1 and True.
    key = tuple(asked), repr(asked)
    return _kept(_measured.setdefault(model, {}), key, lambda: with_measures(model.mechanism, asked))


def reading_plan(
    model: Model, asked: Sequence[Reading | str] | None, measured: Mechanism, batch: Batch, driving: Driving
) -> ReadingPlan:
    """Return how measures are read; calls for the same measures, parameters and samples have the same plan."""
    driven = driving.driven
    moved: tuple[Hashable, ...] = (batch.constants[0].tobytes(),)
    if driven is not None:
        moved = tuple((table.ndim, (table[0] if table.ndim == 3 else table).tobytes()) for table in driven)
    key = asked and (tuple(asked), repr(asked)), tuple(batch.parameters), driving.times.tobytes(), moved
    return _kept(_plans.setdefault(model, {}), key, lambda: ReadingPlan(model, measured, batch, driving))


def _kept(kept: dict[Hashable, T], key: Hashable, make: Callable[[], T]) -> T:
    """Return what is kept, or make it; measures of users need not be hashable."""
    try:
        found = kept.get(key)
    except TypeError:
        return make()
    if found is None:
        found = make()
        if len(kept) >= _MOST_KEPT:
            kept.pop(next(iter(kept)), None)
        kept[key] = found
    return found


def samples_of(batch: Batch, driving: Driving, design: int) -> SampledAxis:
    """Return the samples of a design."""
    plan, (times, driven, _) = batch.plan, driving
    names = tuple(name for driver in plan.drivers for name in driver.inputs)
    if driven is None:
        axis = TIME
        constants = batch.constants[design]
        drive = load_model(plan).drive
        table = np.array([drive(time, tuple(constants.tolist())) for time in times.tolist()], dtype=float)
        inputs = table.reshape(len(times), 3, len(plan.drivers)).transpose(0, 2, 1)
    else:
        tables = [table[design] if table.ndim == 3 else table for table in driven]
        axis, inputs = axis_for(tables[0], names[::3]), np.stack(tables, axis=2)
    return SampledAxis(times, axis, names, inputs.reshape(len(times), len(names)), plan.mechanism.length_unit)


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
    behind = {place: parameters_behind(mechanism.parameters, one) for place, one in mechanism.expressions.items()}
    return [place for place, names in behind.items() if names.intersection(given)]
