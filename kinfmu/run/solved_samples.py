"""SolvedSamples: a run of samples that are solved; forces, events and the like are computed when they are read."""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.run import Event, Run
from kinfmu.run.arguments import Setting
from kinfmu.run.axis import TIME, axis_for
from kinfmu.run.designs import Solvable
from kinfmu.run.driving import with_constants
from kinfmu.run.engine import Driven, Engine, SweepResult, Tables
from kinfmu.run.forces import ForceModel, LoadedRun
from kinfmu.units import CoordinateName, ForceName, InputName


class SolvedModel(Solvable, Protocol):
    """What a run needs of a Model."""

    outputs: tuple[CoordinateName, ...]
    input_names: tuple[InputName, ...]
    watch_names: tuple[str, ...]
    force_names: tuple[ForceName, ...]
    reaction_names: tuple[ForceName, ...]

    @property
    def force_model(self) -> ForceModel: ...


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

    model: SolvedModel
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
