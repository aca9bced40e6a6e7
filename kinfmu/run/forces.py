"""Forces of a run: efforts of the drivers, reduced inertia, energies and reactions at all samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.lanes.stage import strided_columns
from kinfmu.codegen.python.stage import CompiledStage, load_stage
from kinfmu.mechanism.force_names import shaking_names
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.forces import force_names, force_steps, loaded_coordinates
from kinfmu.plan.origin import localized
from kinfmu.plan.reactions import reaction_names_of, reaction_steps, shaking_steps
from kinfmu.plan.steps import derivative_name, law_symbol
from kinfmu.plan.trace import parameter_symbol
from kinfmu.plan.undetermined import distance_steps, meeting_messages, undetermined_reactions
from kinfmu.run import Run
from kinfmu.run.arguments import Setting
from kinfmu.run.designs import Solvable
from kinfmu.run.engine import Driven
from kinfmu.run.stages import native_results, native_stage, stage_results
from kinfmu.solver.python.pose import Status

LEAST_SPEED = 1e-100  # [rad/s, ...] of a driver; products with smaller ones lose digits
_STAGES = 6  # forces by each kind of coefficients, reactions, those on the ground alone, distances of ends
Given = dict[str, FloatArray | float]


class LoadedRun(NamedTuple):
    """What the forces of a run are computed from.

    poses: a run of the force plan; driven: (n, d) values, speeds and accelerations of the drivers; has_gaps: False if
    all samples are known to have numbers; efforts: of external loads, (n,) by their inputs; times: (n,) for the laws of
    loads, or None where driver values are given in place of times: laws over time then have no values.
    """

    poses: Run
    driven: Driven
    has_gaps: bool
    setting: Setting
    efforts: Mapping[str, FloatArray]
    times: FloatArray | None


class ForceModel:
    """The forces of a model; code is printed when it is first needed and kept.

    Args:
        poses: A model of `force_plan`.

    """

    def __init__(self, poses: Solvable) -> None:
        self.poses = poses
        self.names = force_names(poses.plan.mechanism)
        self._native = lru_cache(maxsize=_STAGES)(native_stage)

    def forces(self, run: LoadedRun) -> FloatArray:
        """Return the forces at all samples, (n, names); NaN where the run has no numbers.

        The velocity coefficients of a single driver that never rests are the rates over its speed. Else blocks give
        them; not at samples that are interpolated across a singular point, where they come from rates.
        """
        if self._is_moved_by_one(run):
            return self._without_gaps(self._evaluated(self._stage_of_rates, run, slice(None), len(run.poses)), run)
        status = run.poses.status
        forces = self._evaluated(self._stage, run, slice(None), len(status))
        irregular = np.flatnonzero(status >= Status.BRIDGED)  # few: tables of the others would be copied without them
        forces[irregular] = np.nan
        bridged = irregular[status[irregular] == Status.BRIDGED]
        if len(bridged):
            coefficients = self._coefficients(run, bridged)
            forces[bridged] = self._evaluated(self._stage_of_coefficients, run, bridged, len(bridged), coefficients)
        return forces

    def reactions(self, run: LoadedRun) -> FloatArray:
        """Return the reactions at all samples, (n, reactions).

        Those of joints are NaN where the run has no numbers, at samples that are interpolated across a singular point,
        where the rows do not determine them, and for rows that share a load with redundant ones. Shaking force and
        moment follow from the motion alone.
        """
        reactions = self._evaluated(self._reaction_stage, run, slice(None), len(run.poses))
        reactions[:, self._undetermined] = np.nan
        status = run.poses.status
        irregular = np.flatnonzero(status >= Status.BRIDGED)
        reactions[irregular, : reactions.shape[1] - self._shaking_count] = np.nan
        bridged = irregular[status[irregular] == Status.BRIDGED]
        singular = bridged[np.isnan(reactions[bridged, -1])]  # a division by 0 leaves a sample without all results
        if len(singular):
            shaking = self._evaluated(self._shaking_stage, run, singular, len(singular))
            reactions[singular, -self._shaking_count :] = shaking
        return self._without_gaps(reactions, run)

    def shaking(self, run: LoadedRun) -> FloatArray:
        """Return shaking force and moment at all samples, (n, 3); NaN where the run has no numbers."""
        return self._without_gaps(self._evaluated(self._shaking_stage, run, slice(None), len(run.poses)), run)

    def meetings(self, run: LoadedRun) -> list[tuple[int, str]]:
        """Return the first sample at which a load has no direction, and the message, for each such load."""
        stage, messages = self._distances
        if not messages:
            return []
        distances = self._evaluated(stage, run, slice(None), len(run.poses))
        found = []
        for message, own in zip(messages, distances.T, strict=True):
            samples = np.flatnonzero((own == 0.0) & (run.poses.status <= Status.BRIDGED))
            if len(samples):
                found.append((int(samples[0]), message))
        return found

    def _without_gaps(self, results: FloatArray, run: LoadedRun) -> FloatArray:
        """Return results (n, ...), NaN at the samples that have no numbers."""
        if run.has_gaps:
            results[run.poses.status > Status.BRIDGED] = np.nan
        return results

    def _is_moved_by_one(self, run: LoadedRun) -> bool:
        """Return whether there is a single driver and its speed is nowhere too small to divide by."""
        speeds = run.driven[1]
        if speeds.shape[1] > 1:
            return False
        if speeds.strides[0] == 0 and len(speeds):  # they are all the same
            return abs(float(speeds[0, 0])) > LEAST_SPEED
        return bool(speeds.min(initial=np.inf) > LEAST_SPEED or speeds.max(initial=-np.inf) < -LEAST_SPEED)

    @cached_property
    def _stage(self) -> CompiledStage:
        return load_stage(force_steps(self.poses.plan, self.names))

    @cached_property
    def _stage_of_coefficients(self) -> CompiledStage:
        return load_stage(force_steps(self.poses.plan, self.names, coefficients="given"))

    @cached_property
    def _stage_of_rates(self) -> CompiledStage:
        return load_stage(force_steps(self.poses.plan, self.names, coefficients="rates"))

    @cached_property
    def _reaction_stage(self) -> CompiledStage:
        return load_stage(reaction_steps(self.poses.plan))

    @cached_property
    def _shaking_stage(self) -> CompiledStage:
        return load_stage(shaking_steps(self.poses.plan))

    @cached_property
    def _distances(self) -> tuple[CompiledStage, tuple[str, ...]]:
        """The distances between the ends of loads that need a direction, and a message for each."""
        steps = distance_steps(self.poses.plan)
        return load_stage(steps), meeting_messages(self.poses.plan, steps)

    @cached_property
    def _shaking_count(self) -> int:
        """How many columns, the last of the reactions, are shaking force and moment."""
        return len(shaking_names(self.poses.plan.mechanism))

    @cached_property
    def _undetermined(self) -> list[int]:
        """Columns of the reactions that are undetermined."""
        names = reaction_names_of(self.poses.plan.mechanism)
        return [names.index(name) for name in undetermined_reactions(self.poses.plan)]

    @cached_property
    def _columns(self) -> dict[str, tuple[int, int]]:
        """Table and column of each symbol that a run has: values, rates, accelerations, the same of the drivers."""
        names = [[name.derivative(order) for name in self.poses.plan.outputs] for order in range(3)]
        names += [[driver.inputs[order] for driver in self.poses.plan.drivers] for order in range(3)]
        return {name: (table, k) for table, own in enumerate(names) for k, name in enumerate(own)}

    def _given(self, run: LoadedRun, samples: Any) -> Given:
        """Return the numbers of the symbols that are not columns of the run, at some samples."""
        plan, setting = self.poses.plan, run.setting
        given: Given = {"time": np.nan if run.times is None else run.times[samples]}
        given |= {name: effort[samples] for name, effort in run.efforts.items()}
        written = [parameter.value for parameter in plan.parameters]
        for parameter, value in zip(plan.parameters, setting.values or written, strict=True):
            given[parameter_symbol(parameter.name)] = value
        constants = (*plan.law_constants, *plan.load_constants)
        for constant, value in zip(constants, (*setting.constants, *setting.load_constants), strict=True):
            given[law_symbol(constant.name)] = value
        return given

    def _coefficients(self, run: LoadedRun, samples: Any) -> Given:
        """Return the derivatives of the coordinates with respect to each driver.

        With one driver that moves they are the rates over its speed; else the rates of runs in which one driver has a
        speed of 1 and the others rest.
        """
        plan = self.poses.plan
        speed = run.driven[1][samples]
        if len(plan.drivers) == 1 and (np.abs(speed) > LEAST_SPEED).all():
            rates = run.poses.rates[samples] / speed
            return {derivative_name(name, 0): rate for name, rate in zip(plan.outputs, rates.T, strict=True)}
        values = {driver.inputs[0]: run.driven[0][samples, k] for k, driver in enumerate(plan.drivers)}
        found: Given = {}
        for number in range(len(plan.drivers)):
            speeds: dict[str, Any] = {driver.inputs[1]: float(k == number) for k, driver in enumerate(plan.drivers)}
            rates = self.poses.solve(parameters=run.setting.given, **values, **speeds).rates.T
            found |= {derivative_name(name, number): rate for name, rate in zip(plan.outputs, rates, strict=True)}
        return found

    def _evaluated(
        self, stage: CompiledStage, run: LoadedRun, samples: Any, n: int, coefficients: Given | None = None
    ) -> FloatArray:
        """Return the results of a stage at n samples, (n, results)."""
        tables = (run.poses.values, run.poses.rates, run.poses.accelerations, *run.driven)
        shape, columns = (len(stage.steps.results), n), self._columns
        native = self._native(stage) if self.poses.is_native(n) else None
        if native is not None and n and isinstance(samples, slice) and all(map(columns.__contains__, stage.given)):
            whole = strided_columns(tables, [columns[name] for name in stage.given])
            return native_results(stage, native, whole, shape, is_checked=False)[0].T
        given = self._given(run, samples) | (coefficients or {})
        numbers = [given[name] if name in given else _column(tables, columns[name], samples) for name in stage.given]
        return stage_results(stage, native, numbers, shape, is_checked=False)[0].T


def _column(tables: Sequence[FloatArray], place: tuple[int, int], samples: Any) -> FloatArray:
    table, column = place
    found: FloatArray = tables[table][samples, column]
    return found


def force_plan(plan: SolvePlan) -> SolvePlan:
    """Return a plan whose outputs are all coordinates that forces depend on, seen from its own origin; or the same."""
    moving = [name for name in plan.mechanism.coordinate_names if name not in plan.known]
    if set(moving) <= set(plan.outputs) and plan.origin == (0.0, 0.0):
        return plan
    local, _ = localized(plan.mechanism)
    local, open_ones = replace(local, coordinates="moving"), [parameter.name for parameter in plan.parameters]
    wanted = [name for name in loaded_coordinates(local) if name in moving]
    solved = {name for block in compile_plan(local, wanted, open_ones).blocks for name in block.coordinates}
    found = compile_plan(local, [name for name in moving if name in solved], open_ones)
    return replace(found, origin=plan.origin)  # potential energy counts from the world's origin
