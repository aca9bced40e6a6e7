"""The slave of a python FMU. The FMU has a copy, so it imports only the standard library and pythonfmu's base class.

An exception that leaves a slave is Fatal in pythonfmu, and by FMI's rules it ends every instance of the host. So
nothing here raises: errors are logged and the next doStep returns Discard. pythonfmu's binary does the rest: it keeps
the last successful time, returns true for fmi2Terminated after the first Discard (a slave cannot change this, but the
host may continue), passes messages only to hosts that instantiate with loggingOn, and does not compare the guid.
"""

from __future__ import annotations

import ctypes
import json
import math
import sys
from collections.abc import Sequence
from hashlib import sha256
from typing import Any

from pythonfmu.enums import Fmi2Status

from kinfmu.fmu.estimated_rates import KEPT
from kinfmu.fmu.layout import Numbers
from kinfmu.fmu.slave_outputs import LAST_GOOD
from kinfmu.fmu.slave_settings import SlaveSettings
from kinfmu.solver.python import Pose, UnsolvableModel, with_parameters

SAME_TIME = 1e-9  # of a step: rounding errors of times that hosts add up
LATE = 1e-3  # of a step: a sum of a million steps may end this late
ROUNDING = 4.44e-16  # of a time: its last digits
DIGEST = 32  # bytes of a SHA-256
PLAIN = (  # attributes, without the underscore, that are a number or a truth value: a state has them as they are
    *("driven_by_time", "rates", "initialized", "running", "touched", "stray_reported"),
    *("start_time", "time", "stop_time"),
)


def as_numbers(values: Sequence[float], like: Sequence[float]) -> Numbers:
    """Return as many numbers as there are in `like`; raise a ValueError or TypeError for anything else."""
    return tuple([float(value) for value, _ in zip(values, like, strict=True)])


class MechanismSlave(SlaveSettings):
    """A mechanism as an FMI 2.0 co-simulation slave.

    The protocol: a set clears the cache; a get solves from the *committed* pose and caches; doStep commits the pose and
    appends (communication point, driver values) to the history. So trial values never influence a result, an unchanged
    input is not solved again, and velocity and acceleration are computed when they are first read.

    A subclass defines `model` (the emitted module) and `layout`.
    """

    def __init_subclass__(cls) -> None:
        """Copy the methods of a step into the subclass: pythonfmu's binary looks them up by name, class by class."""
        super().__init_subclass__()
        for name in ("set_real", "do_step", "get_real"):
            setattr(cls, name, getattr(cls, name))

    def setup_experiment(self, start_time: float, stop_time: float | None = None, *_: Any) -> None:
        if not math.isfinite(start_time):
            self._refuse("start time", f"= {start_time!r} s is not a finite number; {self._start_time!r} s stays")
            return
        self._time = self._start_time = start_time
        self._stop_time = sys.float_info.max if stop_time is None else stop_time
        self._refused.pop("start time", None)
        self._forget()

    def exit_initialization_mode(self) -> None:
        try:
            self._initialized = self._running = True
            if self._unbound:
                self._bind()
            pose = self._requested()
            if not pose.good and not isinstance(self._solver, UnsolvableModel):
                self.log(f"initialization fails: at t = {self._time:g} s: {pose.message}", Fmi2Status.error)
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)

    def terminate(self) -> None:
        self._running = False

    def do_step(self, current_time: float, step_size: float) -> bool:
        try:
            end = current_time + step_size
            if not (self._running and step_size >= 0.0 and self._start_time <= current_time <= end <= self._stop_time):
                reason = self._no_step(current_time, step_size)
                if reason:
                    self.log(reason, Fmi2Status.error)
                    return False
            if self._driven_by_time or self._refused:
                return self._step(current_time, step_size)
            pose = self._pose
            if pose is None:
                inputs = self._inputs
                u = (inputs[0],) if len(inputs) == 3 else tuple(inputs[::3])
                pose = self._pose = self._solver.solve(self._committed, u)
            if pose.status > LAST_GOOD:
                return self._discard(pose, current_time)
            if not self._touched or current_time != self._time:
                self._shown = self._motion = None  # the time of the rates changes: inputs are held, or clocks differ
            history = self._history
            repeated_from = current_time - SAME_TIME * step_size - ROUNDING * abs(current_time)
            if len(history) == KEPT and history[-1][0] < repeated_from:  # the frequent case of _commit
                self._history = (history[1], history[2], history[3], (current_time, pose.u))
                self._committed = pose
                self._touched = False
                if self._wired:
                    self._committed_inputs = tuple(self._inputs)
            else:
                self._commit(pose, current_time, step_size)
            self._time = end
            return True
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)
            return False

    def _no_step(self, current_time: float, step_size: float) -> str:
        """Return why a step is invalid, or an empty text."""
        if not self._running:
            return "doStep before the end of initialization, or after terminate"
        if not (math.isfinite(current_time + step_size) and step_size >= 0.0):
            return f"doStep from t = {current_time:g} s by {step_size:g} s: they must be finite, the step at least 0"
        if current_time < self._start_time - SAME_TIME * step_size:
            return f"doStep from t = {current_time!r} s: that is before the start at {self._start_time!r} s"
        if current_time + step_size - self._stop_time > LATE * step_size + ROUNDING * abs(self._stop_time):
            return (
                f"doStep from t = {current_time:.12g} s by {step_size:.12g} s: past the stop time of the experiment, "
                f"{self._stop_time:.12g} s"
            )
        return ""

    def _step(self, current_time: float, step_size: float) -> bool:
        """Do a step when time drives, from the pose at its start; or discard it after a refused value."""
        if self._inputs != self._input_starts and self._driven_by_time and not self._stray_reported:
            self._warn_of_inputs()
        if self._refused:
            for reason in self._refused.values():
                self.log(f"at t = {current_time:g} s: {reason}", Fmi2Status.discard)
            self._refused.clear()
            return False
        pose = self._at_start_of_step(current_time, step_size)
        if pose.good:
            self._time = current_time + step_size
            pose = self._solver.solve(pose, self._law(self._time))
        else:
            self._time = current_time
        self._forget()
        self._pose = pose
        if not pose.good:
            return self._discard(pose, self._time)
        self._commit(pose, self._time, step_size)
        return True

    def _warn_of_inputs(self) -> None:
        """Warn once if inputs were set although time drives."""
        self._stray_reported = True
        pairs = zip(self._inputs, self._input_starts, strict=True)
        first = next(k for k, (value, start) in enumerate(pairs) if value != start)
        names = next(part.variables for part in self.layout.parts if part.name == "inputs")
        text = f"{names[first]} was set, but driven_by_time is true: the law drives, inputs have no effect"
        self.log(text, Fmi2Status.warning)

    def _at_start_of_step(self, current_time: float, step_size: float) -> Pose:
        """Return the pose at the start of a step when time drives: the committed one, unless it has changed."""
        if self._history and not self._touched and abs(current_time - self._history[-1][0]) <= SAME_TIME * step_size:
            return self._committed
        return self._solver.solve(self._committed, self._law(current_time))

    def _commit(self, pose: Pose, t: float, step_size: float) -> None:
        """Make a pose the committed one, and append its time and driver values to the history."""
        history = self._history
        repeated_from = t - SAME_TIME * step_size - ROUNDING * abs(t)
        while history and history[-1][0] >= repeated_from:  # the host repeats a step, or goes back
            history = history[:-1]
        self._history = (*history[1 - KEPT :], (t, pose.u))
        self._committed = pose
        self._committed_inputs = tuple(self._inputs)
        self._touched = False

    def _discard(self, pose: Pose, t: float) -> bool:
        self.log(f"at t = {t:g} s: {pose.message}", Fmi2Status.discard)
        return False

    # State: all that results depend on, as JSON

    def _get_fmu_state(self) -> dict[str, Any]:
        return {name: getattr(self, f"_{name}") for name in PLAIN} | {
            "token": self.layout.token,
            "inputs": list(self._inputs),
            "constants": list(self._constants),
            "parameters": list(self._parameters),
            "tolerance": self._tolerance,
            "wired": sorted(self._wired),
            "refused": dict(self._refused),
            "committed": self._solver.dump(self._committed),
            "committed_inputs": list(self._committed_inputs),
            "history": [[t, list(u)] for t, u in self._history],
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        before = dict(self.__dict__)
        try:
            if state.get("token") != self.layout.token:
                self._refuse("state", f"is damaged, or not one of this FMU ({self.layout.token})")
                return
            self._restore(state)
        except Exception as error:  # an exception here would be Fatal for the host
            self.__dict__.update(before)
            self._refuse("state", f"is damaged: {type(error).__name__}: {error}")

    def _restore(self, state: dict[str, Any]) -> None:
        for name in PLAIN:
            setattr(self, f"_{name}", state[name])
        self._inputs = list(as_numbers(state["inputs"], self._inputs))
        self._constants = as_numbers(state["constants"], self._constants)
        self._parameters = as_numbers(state["parameters"], self._parameters)
        self._tolerance = float(state["tolerance"])
        self._wired = set(state["wired"])
        self._refused = dict(state["refused"])
        self._unbound = False
        self._solver = with_parameters(self.model, self._parameters, self._tolerance)
        self._committed = self._solver.restore(state["committed"])
        self._committed_inputs = as_numbers(state["committed_inputs"], self._inputs)
        self._history = tuple((t, tuple(u)) for t, u in state["history"])
        self._forget()

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        """Return the state as JSON, after its SHA-256."""
        data = json.dumps(state).encode()
        return sha256(data).digest() + data

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        data = bytes(state[DIGEST:])
        if len(state) < DIGEST or sha256(data).digest() != state[:DIGEST]:
            return {}  # setting it is refused; an exception here would be Fatal for the host
        return json.loads(data)  # type: ignore[no-any-return]  # written by _fmu_state_to_bytes


def hold(namespace: dict[str, Any]) -> None:
    """Take a permanent reference to a module's namespace.

    pythonfmu 0.7 runs the slave's module once per instance, and each time releases a reference to its namespace that it
    does not own: without this, the third instance of a process would find the namespace freed and crash.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))
