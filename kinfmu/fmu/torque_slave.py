"""The slave that owns the motion of its drivers: efforts are inputs, values and speeds are states.

    J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

The FMU has a copy: see slave.py. Efforts and external loads hold during a step of the host, and act at once: a get
after a set has the new accelerations. A step that passes a limit is discarded, and states and pose stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status

from kinfmu.fmu.estimated_rates import LARGEST
from kinfmu.fmu.force_slave import ForceSlave
from kinfmu.fmu.layout import Numbers
from kinfmu.fmu.slave import as_numbers
from kinfmu.solver.python import Pose, Status
from kinfmu.solver.python.pose import failed
from kinfmu.solver.python.torque import Course, DormandPrince, Ended, EquationOfMotion, Given, Laws, TorqueSteps
from kinfmu.solver.python.torque.law_breaks import LEAST_TOLERANCE, MOST_TOLERANCE

_UNDETERMINED = "the reduced inertia is singular, or a number is not finite"


class TorqueSlave(ForceSlave):
    """A mechanism that efforts drive as an FMI 2.0 co-simulation slave.

    A subclass defines `inertia` (emitted: bias efforts and reduced inertia), `jumps` (emitted: of loads over time),
    `laws` (emitted: arguments and breaks of laws over quantities), `law_counts` (of breaks) and `in_si` (units).
    """

    inertia: ClassVar[Callable[..., Numbers]]
    jumps: ClassVar[Callable[[Numbers, Numbers], Sequence[tuple[float, float]]]]
    laws: ClassVar[Callable[..., Numbers]]
    law_counts: ClassVar[tuple[int, ...]]
    in_si: ClassVar[Numbers]
    _udd: Numbers | None  # accelerations of the drivers at the requested pose
    _ended: Ended | None  # why the last step was discarded

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        parts = {part.name: part for part in self.layout.parts}
        self._efforts: Numbers = parts["efforts"].starts
        self._integrator_tolerance: float = parts["tolerance"].starts[1]
        self._wired = {k for k in range(len(self._inputs)) if k % 3}  # all rates are known
        self._equation = EquationOfMotion(self.inertia, self.in_si)
        self._step_size = 0.0  # that the integrator would take next, 0 at the start

    def setup_experiment(self, start_time: float, stop_time: float | None = None, *rest: Any) -> None:
        super().setup_experiment(start_time, stop_time)
        tolerance = rest[0] if rest else None
        if tolerance is not None and tolerance > 0.0:
            self._integrator_tolerance = min(max(tolerance, LEAST_TOLERANCE), MOST_TOLERANCE)

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        try:
            pose = self._requested()
            if not pose.good:
                return
            found = self._found(pose)
            if found is None:
                ud = tuple(self._inputs[1::3])
                massless = self._equation.massless(self._solver, pose, self._time, ud, self._given())
                driver = self.model.DRIVERS[massless[0] if massless else 0]
                self._refuse(
                    "initialization",
                    f"fails: driver {driver}: its reduced inertia is 0, so that efforts do not determine its motion; "
                    "give a body that it moves a mass or an inertia",
                )
                return
            self._commit_at(pose, self._time, 0.0, found)
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)

    def do_step(self, current_time: float, step_size: float) -> bool:
        try:
            end = current_time + step_size
            if not (self._running and step_size >= 0.0 and self._start_time <= current_time <= end <= self._stop_time):
                reason = self._no_step(current_time, step_size)
                if reason:
                    self.log(reason, Fmi2Status.error)
                    return False
            if self._refused:
                for reason in self._refused.values():
                    self.log(f"at t = {current_time:g} s: {reason}", Fmi2Status.discard)
                self._refused.clear()
                return False
            return self._step_by_efforts(current_time, step_size)
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)
            return False

    def _step_by_efforts(self, t: float, h: float) -> bool:
        """Do a step: states and pose at both of its ends are committed."""
        if self._ended is not None:
            self._forget()
        self._time = t
        pose = self._requested()
        if not pose.good:
            return self._discard(pose, t)
        found = self._found(pose)
        if found is None:
            self.log(f"at t = {t:g} s: {_UNDETERMINED}", Fmi2Status.discard)
            return False
        self._commit_at(pose, t, h, found)
        given, ud = self._given(), tuple(self._inputs[1::3])

        def accelerations(at: float, pose: Pose, ud: Numbers) -> Numbers | None:
            return self._equation.accelerations(self._solver, pose, at, ud, given)

        def law_numbers(pose: Pose) -> Numbers:
            return self.laws(0.0, pose.u, (), (), pose.z, (), (), (), given.loads, given.parameters)

        integrator = DormandPrince(self._integrator_tolerance, self._step_size)
        steps = TorqueSteps(Course(self._solver, accelerations), integrator, Laws(self.law_counts, law_numbers))
        at = steps.run(pose, ud, t, t + h, type(self).jumps(self._loads, self._parameters))
        if steps.ended is not None:
            self._forget()
            self._set_ended(steps.ended)
            return self._discard(self._requested(), steps.ended.t)
        if at is not None:  # else the step has no length
            self._step_size = integrator.size if integrator.size < math.inf else 0.0
            d = len(ud)
            self._inputs[0::3], self._inputs[1::3] = at.y[:d], at.y[d:]
            pose = at.pose
        self._time = t + h
        self._commit_at(pose, self._time, h, self._found(pose))
        return True

    def _set_ended(self, ended: Ended) -> None:
        """Show why a motion ended: the requested pose is past its end."""
        self._ended = ended
        self._pose = failed(self._committed, ended.u, Status(ended.status), ended.message)

    def _commit_at(self, pose: Pose, t: float, step_size: float, udd: Numbers | None) -> None:
        """Commit states and pose."""
        if udd is not None:
            self._inputs[2::3] = udd
        self._commit(pose, t, step_size)
        self._committed_loads = self._loads
        self._shown = self._motion = None
        self._pose, self._udd = pose, udd

    # The requested sample

    def _forget(self) -> None:
        super()._forget()
        self._udd = self._ended = None

    def _given(self) -> Given:
        return Given(self._efforts, self._loads, self._parameters)

    def _found(self, pose: Pose) -> Numbers | None:
        """Return the accelerations of the drivers at a pose now."""
        return self._equation.accelerations(self._solver, pose, self._time, tuple(self._inputs[1::3]), self._given())

    def _requested(self) -> Pose:
        pose = self._pose
        if pose is None and self._history and self._wanted() == self._committed.u:
            pose = self._pose = self._committed
        return super()._requested() if pose is None else pose

    def _driven(self) -> tuple[Numbers, Numbers, Numbers]:
        udd = self._udd
        if udd is None:
            udd = self._found(self._requested())
            if udd is None:
                self._refuse("accelerations", f"have no value: {_UNDETERMINED}")
                udd = self._committed_inputs[2::3]
            self._udd = udd
            self._inputs[2::3] = udd
        return self._wanted(), tuple(self._inputs[1::3]), udd

    def _read_states(self) -> Numbers:
        return tuple([value for driver in zip(*self._drive(self._look()), strict=True) for value in driver])

    def _read_efforts(self) -> Numbers:
        return self._efforts

    def _read_tolerance(self) -> Numbers:
        return (self._tolerance, self._integrator_tolerance)

    # Set

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        for vr, value in zip(vrs, values):  # noqa: B905  # the host's lists are equally long
            self._set_other_real(vr, value)

    def _set_other_real(self, vr: int, value: float) -> None:
        part, place = self._references.real(vr)
        kind = "" if part is None else self.layout.parts[part].name
        name = self._references.name(vr)
        if kind not in ("states", "efforts", "loads") and not (kind == "tolerance" and place):
            super()._set_other_real(vr, value)
            return
        if kind == "states" and place % 3 == 2:
            self._refuse(name, "is not a Real variable that can be set")
            return
        if not -LARGEST <= value <= LARGEST:
            why = f"is too large: at most {LARGEST:g} is taken" if math.isfinite(value) else "is not a finite number"
            self._refuse(name, f"= {value!r} {why}; {self.get_real([vr])[0]!r} stays")
            return
        if name in self.positive and not value > 0.0:
            self._refuse(name, f"= {value!r} must be positive; {self.get_real([vr])[0]!r} stays")
            return
        if kind == "states":
            if self._initialized:
                text = "comes too late: it is a state, which the FMU integrates once it is initialized"
                self._refuse(name, f"= {value!r} {text}")
                return
            self._inputs[place] = float(value)
            self._forget()
        elif kind == "tolerance":
            if not LEAST_TOLERANCE <= value <= MOST_TOLERANCE:
                bounds = f"{LEAST_TOLERANCE:g} to {MOST_TOLERANCE:g}"
                self._refuse(name, f"= {value!r} must be {bounds}; {self._integrator_tolerance!r} stays")
                return
            self._integrator_tolerance = float(value)
            self._forget()
        else:
            self._set_effort(kind, place, float(value))
        self._refused.pop(name, None)
        self._touched = True

    def _set_effort(self, kind: str, place: int, value: float) -> None:
        """Set an effort of a driver or an external load; accelerations and forces change, the pose does not."""
        before = self._efforts if kind == "efforts" else self._loads
        after = (*before[:place], value, *before[place + 1 :])
        if kind == "efforts":
            self._efforts = after
        else:
            self._loads = after
        if self._ended is not None:
            self._forget()
        self._shown = self._motion = self._udd = None

    # State

    def _get_fmu_state(self) -> dict[str, Any]:
        return super()._get_fmu_state() | {
            "efforts": list(self._efforts),
            "integrator_tolerance": self._integrator_tolerance,
            "step_size": self._step_size,
            "ended": None if self._ended is None else list(self._ended),
        }

    def _restore(self, state: dict[str, Any]) -> None:
        efforts = as_numbers(state["efforts"], self._efforts)
        tolerance, size = float(state["integrator_tolerance"]), float(state["step_size"])
        super()._restore(state)
        self._efforts, self._integrator_tolerance, self._step_size = efforts, tolerance, size
        if state["ended"] is not None:
            t, u, status, message = state["ended"]
            self._set_ended(Ended(t, tuple(u), status, message))
