"""The slave of a mechanism with masses or loads: forces are outputs, efforts of external loads are inputs.

The FMU has a copy: see slave.py. Forces are computed when one of them is read, and kept until a set or a step changes
the sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status

from kinfmu.fmu.estimated_rates import LARGEST
from kinfmu.fmu.layout import NOT_A_NUMBER, Numbers
from kinfmu.fmu.slave import MechanismSlave
from kinfmu.fmu.slave_outputs import Shown
from kinfmu.solver.python.pose import Status
from kinfmu.solver.python.tracks import sample_rates


class ForceSlave(MechanismSlave):
    """A mechanism with forces as an FMI 2.0 co-simulation slave.

    A subclass defines `stages` (emitted, by part), `positive` (names of the constants of loads' laws that must be
    positive) and, if loads need a direction, `distances` (emitted) of their ends with a message for each in `meeting`.
    """

    stages: ClassVar[dict[str, Callable[..., Numbers]]]
    distances: Callable[..., Numbers]
    meeting: ClassVar[tuple[str, ...]] = ()
    positive: ClassVar[tuple[str, ...]]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        parts = {part.name: part for part in self.layout.parts}
        self._loads: Numbers = parts["loads"].starts  # efforts of external loads, then constants of the laws of loads
        self._committed_loads = self._loads
        self._forces_of: Shown | None = None  # the sample of `_forces`
        self._forces: dict[str, Numbers] = {}  # by part, as far as they were read
        self._unknown = {stage: (NOT_A_NUMBER,) * len(parts[stage].variables) for stage in self.stages}

    def _set_other_real(self, vr: int, value: float) -> None:
        part, place = self._references.real(vr)
        if part is None or self.layout.parts[part].name != "loads":
            super()._set_other_real(vr, value)
            return
        name = self._references.name(vr)
        if not -LARGEST <= value <= LARGEST:
            why = f"is too large: at most {LARGEST:g} is taken" if math.isfinite(value) else "is not a finite number"
            self._refuse(name, f"= {value!r} {why}; {self._loads[place]!r} stays")
            return
        if name in self.positive and not value > 0.0:
            self._refuse(name, f"= {value!r} must be positive; {self._loads[place]!r} stays")
            return
        self._refused.pop(name, None)
        if value != self._loads[place]:
            self._loads = (*self._loads[:place], float(value), *self._loads[place + 1 :])
            self._forces_of = None

    def do_step(self, current_time: float, step_size: float) -> bool:
        done = super().do_step(current_time, step_size)
        if done:
            self._committed_loads = self._loads
        return done

    def _read_loads(self) -> Numbers:
        return self._loads

    def _read_forces(self) -> Numbers:
        return self._read_stage("forces")

    def _read_reactions(self) -> Numbers:
        return self._read_stage("reactions")

    def _read_shaking(self) -> Numbers:
        return self._read_stage("shaking")

    def _read_stage(self, stage: str) -> Numbers:
        shown = self._look()
        if self._forces_of is not shown:
            self._forces_of, self._forces = shown, {}
        if stage not in self._forces:
            try:
                self._forces[stage] = self._forces_at(shown, stage)
            except (ArithmeticError, ValueError) as error:  # a law of a load without a value
                self.log(f"forces have no value: {error}", Fmi2Status.warning)
                self._forces[stage] = self._unknown[stage]
        return self._forces[stage]

    def _forces_at(self, shown: Shown, stage: str) -> Numbers:
        if stage == "reactions" and shown.pose.status >= Status.BRIDGED:  # the blocks do not give them there
            return self._unknown[stage]
        model, pose = self._solver.model, shown.pose
        u, ud, udd = self._drive(shown)
        zd, zdd, slopes = sample_rates(model, pose, ud, udd)
        time = self._time
        if not self._driven_by_time and self._history and (shown.stale or not self._touched):
            time = self._history[-1][0]  # of the sample that is shown
        loads = self._committed_loads if shown.stale else self._loads
        sample = (time, u, ud, udd, pose.z, zd, zdd, slopes, loads, self._parameters)
        found = self.stages[stage](*sample)
        if self.meeting and any(map(math.isnan, found)):
            for message, distance in zip(self.meeting, self.distances(*sample), strict=True):
                if distance == 0.0:
                    self.log(message, Fmi2Status.warning)
        return found

    def _get_fmu_state(self) -> dict[str, Any]:
        return super()._get_fmu_state() | {
            "loads": list(self._loads),
            "committed_loads": list(self._committed_loads),
        }

    def _restore(self, state: dict[str, Any]) -> None:
        loads, committed = (
            tuple([float(effort) for effort, _ in zip(state[name], self._loads, strict=True)])
            for name in ("loads", "committed_loads")
        )
        super()._restore(state)
        self._loads, self._committed_loads, self._forces_of = loads, committed, None
