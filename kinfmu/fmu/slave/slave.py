"""The slave of a Python FMU.

An exception that leaves a slave is Fatal in pythonfmu, and by FMI's rules it ends every instance of the host. So
nothing here raises: errors are logged and the next doStep returns Discard. pythonfmu's binary does the rest: it keeps
the last successful time, returns true for fmi2Terminated after the first Discard (a slave cannot change this, but the
host may continue), passes messages only to hosts that instantiate with loggingOn, and does not compare the guid.
"""

from __future__ import annotations

import json
import math
import sys
from collections import deque
from collections.abc import Sequence
from hashlib import sha256
from typing import Any

from ...solver.python import Pose, UnsolvableModel, with_parameters
from .base import Fmi2Status
from .estimated_rates import LATE, ROUNDING, SAME_TIME, SAMPLES
from .layout import Numbers
from .variables import SlaveVariables

DIGEST = 32  # bytes of a SHA-256
PLAIN = (  # attributes that are a number or a truth value: a state has them as they are
    *("driven_by_time", "rates", "initialized", "running", "touched", "stray_reported"),
    *("start_time", "time", "stop_time"),
)


def as_numbers(values: Sequence[float], like: Sequence[float]) -> Numbers:
    """Return as many numbers as there are in `like`; raise a ValueError or TypeError for anything else."""
    return tuple([float(value) for value, _ in zip(values, like, strict=True)])


class MechanismSlave(SlaveVariables):
    """A mechanism as an FMI 2.0 co-simulation slave.

    The protocol: a set clears the cache; a get solves from the *committed* pose and caches; doStep commits the pose and
    appends (communication point, driver values) to the history. So trial values never influence a result, an unchanged
    input is not solved again, and velocity and acceleration are computed when they are first read.

    A subclass defines `model` (the emitted module) and `layout`; with masses or loads `stages` and what belongs to
    them; `by_efforts` if efforts drive.
    """

    def __init_subclass__(cls) -> None:
        """Copy the methods of a step into the subclass: pythonfmu's binary looks them up by name, class by class."""
        super().__init_subclass__()
        for name in ("set_real", "do_step", "get_real"):
            setattr(cls, name, getattr(cls, name))

    def setup_experiment(self, start_time: float, stop_time: float | None = None, *rest: Any) -> None:
        if not math.isfinite(start_time):
            self.refuse("start time", f"= {start_time!r} s is not a finite number; {self.start_time!r} s stays")
        else:
            self.time = self.start_time = start_time
            self.stop_time = sys.float_info.max if stop_time is None else stop_time
            self.refused.pop("start time", None)
            self.forget()
        self.motion.setup(*rest)

    def exit_initialization_mode(self) -> None:
        try:
            self.initialized = self.running = True
            if self.unbound:
                self.bind()
            pose = self.requested()
            if pose.good:
                self.motion.begin(pose)
            elif not isinstance(self.solver, UnsolvableModel):
                shifted = self.driven_by_time and self.time != self.layout.start_time
                hint = "; laws count from t = 0 s" if shifted else ""
                self.log(f"initialization fails: at t = {self.time:g} s: {pose.message}{hint}", Fmi2Status.error)
        except Exception as error:  # an exception here would be Fatal for the host
            self.report_defect(error)

    def terminate(self) -> None:
        self.running = False

    def do_step(self, current_time: float, step_size: float) -> bool:
        try:
            end = current_time + step_size
            if not (self.running and step_size >= 0.0 and self.start_time <= current_time <= end <= self.stop_time):
                obstacle = self._obstacle(current_time, step_size)
                if obstacle:
                    self.log(obstacle, Fmi2Status.error)
                    return False
            if self.refused:
                for reason in self.refused.values():
                    self.log(f"at t = {current_time:g} s: {reason}", Fmi2Status.discard)
                self.refused.clear()
                return False
            return self.motion.step(current_time, step_size)
        except Exception as error:  # an exception here would be Fatal for the host
            self.report_defect(error)
            return False

    def _obstacle(self, t: float, h: float) -> str:
        """Return why a step is invalid, or an empty text: rounding may take it a little past the ends."""
        if not self.running:
            return "doStep before the end of initialization, or after terminate"
        if not (math.isfinite(t + h) and h >= 0.0):
            return f"doStep from t = {t:g} s by {h:g} s: they must be finite, the step at least 0"
        if t < self.start_time - SAME_TIME * h:
            return f"doStep from t = {t!r} s: that is before the start at {self.start_time!r} s"
        if t + h - self.stop_time > LATE * h + 2.0 * ROUNDING * abs(self.stop_time):
            past = f"past the stop time of the experiment, {self.stop_time:.12g} s"
            return f"doStep from t = {t:.12g} s by {h:.12g} s: {past}"
        return ""

    def commit(self, pose: Pose, t: float, h: float) -> None:
        """Make a pose the committed one, and append its time and driver values to the history; h: size of the step."""
        history = self.history
        repeated_from = t - SAME_TIME * h - ROUNDING * abs(t)
        while history and history[-1][0] >= repeated_from:  # the host repeats a step, or goes back
            history.pop()
        history.append((t, pose.u))
        self.committed = pose
        self.committed_inputs = tuple(self.inputs)
        self.committed_loads = self.settings["loads"]
        self.touched = False

    def discard(self, pose: Pose, t: float) -> bool:
        """Report that a pose is not reached at time t; return what doStep returns then."""
        self.log(f"at t = {t:g} s: {pose.message}", Fmi2Status.discard)
        return False

    # State: all that results depend on, as JSON

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            **{name: getattr(self, name) for name in PLAIN},
            **{part: list(values) for part, values in self.settings.items()},
            "token": self.layout.token,
            "inputs": list(self.inputs),
            "wired": sorted(self.wired),
            "refused": dict(self.refused),
            "committed": self.solver.dump(self.committed),
            "committed_inputs": list(self.committed_inputs),
            "committed_loads": list(self.committed_loads),
            "history": [[t, list(u)] for t, u in self.history],
            "motion": self.motion.dump(),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        before = {name: getattr(self, name) for name in SlaveVariables.__slots__}
        try:
            if state.get("token") != self.layout.token:
                self.refuse("state", f"is damaged, or not one of this FMU ({self.layout.token})")
                return
            self._restore(state)
        except Exception as error:  # an exception here would be Fatal for the host
            for name, value in before.items():
                setattr(self, name, value)
            self.refuse("state", f"is damaged: {type(error).__name__}: {error}")

    def _restore(self, state: dict[str, Any]) -> None:
        for name in PLAIN:
            setattr(self, name, state[name])
        self.inputs = list(as_numbers(state["inputs"], self.inputs))
        self.settings = {part: as_numbers(state[part], values) for part, values in self.settings.items()}
        self.wired = set(state["wired"])
        self.refused = dict(state["refused"])
        self.unbound = False
        self.solver = with_parameters(self.model, self.settings["parameters"], self.settings["tolerance"][0])
        self.committed = self.solver.restore(state["committed"])
        self.committed_inputs = as_numbers(state["committed_inputs"], self.inputs)
        self.committed_loads = as_numbers(state["committed_loads"], self.committed_loads)
        self.history = deque([(t, tuple(u)) for t, u in state["history"]], SAMPLES)
        self.motion = self.new_motion()
        self.forget()
        self.motion.restore(state["motion"])

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
