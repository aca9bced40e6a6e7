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
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from kinfmu.fmu.estimated_rates import (
    KEPT,
    LARGEST,
    Rates,
    Sample,
    errors_of_estimated_rates,
    estimated_rates,
)
from kinfmu.fmu.layout import NOT_A_NUMBER, UNKNOWN_ERROR, Fetch, Layout, Places, Row, plan_fetch
from kinfmu.solver.python import Pose, Status, UnsolvableModel, with_parameters

LAST_GOOD = int(Status.BRIDGED)  # compared in every read: faster than `Pose.good`
MOST_FETCHES = 256  # lists of value references kept, so that a host that reads at random does not fill the memory
_COUNTS = {
    "solver.status": "status",
    "solver.iterations": "iterations",
    "rates": "rates",
}  # attribute of a pose by variable, or "rates"
SAME_TIME = 1e-9  # of a step: rounding errors of times that hosts add up
LATE = 1e-3  # of a step: a sum of a million steps may end this late
ROUNDING = 4.44e-16  # of a time: its last digits
DIGEST = 32  # bytes of a SHA-256


class Shown:
    """The pose that outputs are read from, with what has been computed from it so far.

    drive: u, ud, udd of the drivers; stale: true for the last good pose, in place of an unreachable requested one.
    """

    __slots__ = ("accelerations", "drive", "errors", "pose", "rates", "stale", "values")

    def __init__(self, pose: Pose, stale: bool) -> None:
        self.pose = pose
        self.stale = stale
        self.drive: tuple[Row, Row, Row] | None = None
        self.values: Row | None = None
        self.rates: Row | None = None
        self.accelerations: Row | None = None
        self.errors: Row | None = None


def _numbers(values: Sequence[float], like: Sequence[float]) -> Row:
    """Return as many numbers as there are in `like`; raise a ValueError or TypeError for anything else."""
    return tuple([float(value) for value, _ in zip(values, like, strict=True)])


class MechanismSlave(Fmi2Slave):  # type: ignore[misc]  # pythonfmu carries no types
    """A mechanism as an FMI 2.0 co-simulation slave.

    The protocol: a set clears the cache; a get solves from the *committed* pose and caches; doStep commits the pose and
    appends (communication point, driver values) to the history. So trial values never influence a result, an unchanged
    input is not solved again, and velocity and acceleration are computed when they are first read.

    A subclass defines `model` (the emitted module) and `layout`.
    """

    model: ClassVar[Any]
    layout: ClassVar[Layout]

    def __init_subclass__(cls) -> None:
        """Copy the methods of a step into the subclass: pythonfmu's binary looks them up by name, class by class."""
        super().__init_subclass__()
        for name in ("set_real", "do_step", "get_real"):
            setattr(cls, name, getattr(cls, name))

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        parts = {part.name: part for part in self.layout.parts}
        self._inputs: list[float] = list(parts["inputs"].starts)  # value, speed, acceleration of each driver
        self._input_starts = list(self._inputs)
        self._constants: Row = parts["constants"].starts
        self._parameters: Row = parts["parameters"].starts
        self._tolerance: float = parts["tolerance"].starts[0]
        self._driven_by_time: bool = parts["drive"].starts[0]
        self._rates: int = parts["rate_source"].starts[0]
        self._references = Places(self.layout)
        self._fetches: dict[tuple[int, ...], Fetch] = {}
        self._last_read: list[int] = []  # value references of the last get_real
        self._last_fetch = self._plan_fetch(())
        self._motion_drive: tuple[Row, Row, Row] = ((), (), ())  # u, ud, udd of `_motion`
        self._last_counted: list[int] = []  # of the last get_integer, and what it reads of a pose
        self._counted: list[str] = []
        self._solver = with_parameters(self.model, self._parameters, self._tolerance)
        self._unbound = False  # parameters were set and are not yet bound

        self._initialized = False
        self._running = False  # from the end of initialization to terminate
        self._start_time = self.layout.start_time
        self._time = self.layout.start_time  # the communication point, or the point that a failed step asked for
        self._stop_time = sys.float_info.max  # of the experiment, if the host gave one
        self._touched = False  # something was set since the last commit
        self._wired: set[int] = set()  # places of the inputs that are used as rates, in place of estimates
        self._refused: dict[str, str] = {}  # by variable: why a value was refused; the next doStep is Discard
        self._stray_reported = False  # the host was warned that inputs have no effect

        self._committed: Pose = self._solver.anchor
        self._committed_inputs: Row = tuple(self._inputs)
        self._history: tuple[Sample, ...] = ()  # the last commits, KEPT at most, oldest first

        self._forget()

    # The requested pose and its cache

    def _forget(self) -> None:
        """Clear the cache, since driver values may have changed: the next get solves."""
        self._pose: Pose | None = None
        self._shown: Shown | None = None
        self._motion: Row | None = None  # values, rates and accelerations in one row, which most hosts read

    def _driven(self) -> tuple[Row, Row, Row]:
        """Return the requested u, ud, udd: by the law at the current time, or by the inputs."""
        if self._driven_by_time:
            return self._solver.model.drive(self._time, self._constants)  # type: ignore[no-any-return]
        t, u = self._moment()
        if self._wired:
            return self._by_inputs(self._inputs, t, u)
        return u, *estimated_rates(self._history, t, u)

    def _law(self, t: float) -> Row:
        """Return u by the laws, or NaN if a rate exceeds LARGEST: there is no pose then."""
        u, ud, udd = self._solver.model.drive(t, self._constants)
        for rate in ud + udd:
            if not -LARGEST <= rate <= LARGEST:
                return (NOT_A_NUMBER,) * len(u)
        return u  # type: ignore[no-any-return]

    def _moment(self) -> Sample:
        """Return the time and u that the inputs request."""
        history = self._history
        if self._touched or not history:
            return self._time, self._wanted()
        return history[-1]  # no set since the commit: the committed sample, at the time of its doStep

    def _by_inputs(self, inputs: Sequence[float], t: float, u: Row) -> tuple[Row, Row, Row]:
        """Return u, ud, udd at time t, with estimates for rates that are not wired."""
        wired = self._wired
        if not wired:
            return u, *estimated_rates(self._history, t, u)
        if len(wired) == 2 * len(u):
            return u, tuple(inputs[1::3]), tuple(inputs[2::3])
        ud, udd = estimated_rates(self._history, t, u)
        ud = tuple([inputs[k] if k in wired else ud[k // 3] for k in range(1, len(inputs), 3)])
        udd = tuple([inputs[k] if k in wired else udd[k // 3] for k in range(2, len(inputs), 3)])
        return u, ud, udd

    def _committed_drive(self) -> tuple[Row, Row, Row]:
        """Return u, ud, udd at the last commit, of the last good values; before it, those of the anchor at rest."""
        if not self._history:
            rest = (0.0,) * len(self._committed.u)
            return self._committed.u, rest, rest
        t, u = self._history[-1]
        if self._driven_by_time:
            return self._solver.model.drive(t, self._constants)  # type: ignore[no-any-return]
        return self._by_inputs(self._committed_inputs, t, u)

    def _wanted(self) -> Row:
        """Return u by the inputs."""
        inputs = self._inputs
        return (inputs[0],) if len(inputs) == 3 else tuple(inputs[::3])  # most mechanisms have one driver: no slice

    def _requested(self) -> Pose:
        """Return the requested pose, good or not, solved from the committed one."""
        pose = self._pose
        if pose is None:
            if self._unbound:
                self._bind()
            u = self._law(self._time) if self._driven_by_time else self._wanted()
            pose = self._pose = self._solver.solve(self._committed, u)
        return pose

    def _look(self) -> Shown:
        """Return the pose that outputs are read from: the requested one if it is good, else the last good one."""
        shown = self._shown
        if shown is None:
            pose = self._pose or self._requested()
            stale = pose.status > LAST_GOOD
            shown = self._shown = Shown(self._committed if stale else pose, stale)
        return shown

    def _drive(self, shown: Shown) -> tuple[Row, Row, Row]:
        """Return u, ud, udd of the shown pose."""
        drive = shown.drive
        if drive is None:
            if self._motion is not None and not shown.stale:  # mostly it was read before
                drive = self._motion_drive
            else:
                drive = self._committed_drive() if shown.stale else self._driven()
            shown.drive = drive
        return drive

    # Parts of the list of variables, each computed when it is first read

    def _read_inputs(self) -> Row:
        return tuple(self._inputs)

    def _read_values(self) -> Row:
        shown = self._look()
        if shown.values is None:
            shown.values = self._solver.outputs(shown.pose)
        return shown.values

    def _read_rates(self) -> Row:
        shown = self._look()
        if shown.rates is None:
            shown.rates = self._solver.rates(shown.pose, self._drive(shown)[1])
        return shown.rates

    def _read_accelerations(self) -> Row:
        shown = self._look()
        if shown.accelerations is None:
            _, ud, udd = self._drive(shown)
            shown.accelerations = self._solver.accelerations(shown.pose, ud, udd)
        return shown.accelerations

    def _read_motion(self) -> Row:
        """Return values, rates and accelerations in one row: common subexpressions are computed once."""
        row = self._motion
        if row is None:
            pose, shown = self._pose or self._requested(), self._shown
            if shown is None and pose.status <= LAST_GOOD:  # mostly it is read first and alone
                drive = self._motion_drive = self._driven()
                row = self._solver.motion(pose, drive[1], drive[2])
            else:
                shown = self._look()
                if shown.values is None and shown.rates is None:
                    _, ud, udd = self._drive(shown)
                    row = self._solver.motion(shown.pose, ud, udd)
                else:  # parts of it were read before
                    row = self._read_values() + self._read_rates() + self._read_accelerations()
            self._motion = row
        return row

    def _read_residual(self) -> Row:
        return (self._requested().residual,)

    def _read_margin(self) -> Row:
        return (self._solver.margin(self._requested()),)  # not computed with the pose: it takes longer than a pose

    def _read_errors(self) -> Row:
        shown = self._look()
        if shown.errors is None:
            _, ud, udd = self._drive(shown)
            off = None if shown.stale or self._driven_by_time else self._errors_of_drive()
            errors = self._solver.errors(shown.pose, ud, udd, off)
            shown.errors = tuple([min(error, UNKNOWN_ERROR) for error in errors])
        return shown.errors

    def _errors_of_drive(self) -> tuple[Row, Row]:
        """Return the errors of ud and udd: those of estimates from samples; inputs have none."""
        speeds, accelerations = errors_of_estimated_rates(self._history, *self._moment())
        wired = self._wired
        return (
            tuple([0.0 if 3 * k + 1 in wired else error for k, error in enumerate(speeds)]),
            tuple([0.0 if 3 * k + 2 in wired else error for k, error in enumerate(accelerations)]),
        )

    def _read_watch(self) -> Row:
        return self._solver.watch(self._look().pose)

    def _read_driven(self) -> Row:
        shown = self._look()
        drive = self._driven() if shown.stale else self._drive(shown)
        if len(drive[0]) == 1:
            return drive[0] + drive[1] + drive[2]
        return tuple(value for driver in zip(*drive, strict=True) for value in driver)

    def _read_constants(self) -> Row:
        return self._constants

    def _read_tolerance(self) -> Row:
        return (self._tolerance,)

    def _read_parameters(self) -> Row:
        return self._parameters

    def _read_fixed(self) -> Row:
        self._requested()  # binds parameters
        return tuple(self._solver.model.FIXED.values())

    def _plan_fetch(self, vrs: tuple[int, ...]) -> Fetch:
        """Return how a list of Real value references is read, and keep it."""
        for vr in vrs:
            if self._references.real(vr)[0] is None:
                self.log(f"value reference {vr} is not a Real variable of this FMU", Fmi2Status.error)
        fetch = plan_fetch(self._references, vrs, lambda part: getattr(self, f"_read_{part}"))
        if len(self._fetches) >= MOST_FETCHES:
            self._fetches.clear()
        self._fetches[vrs] = fetch
        return fetch

    # Get

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        try:
            if vrs != self._last_read:  # most hosts read the same list over and over
                key = tuple(vrs)
                self._last_fetch = self._fetches.get(key) or self._plan_fetch(key)
                self._last_read = list(vrs)
            read, others, pick = self._last_fetch
            row = read()
            if others:
                for read_more in others:
                    row += read_more()
            return list(pick(row) if pick else row)
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)
            return [NOT_A_NUMBER] * len(vrs)

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        try:
            if vrs != self._last_counted:
                self._counted = [_COUNTS.get(self._references.name(vr), "") for vr in vrs]
                self._last_counted = list(vrs)
            if "" in self._counted:
                for vr in (vr for vr, name in zip(vrs, self._counted, strict=True) if not name):
                    self.log(f"value reference {vr} is not an Integer variable of this FMU", Fmi2Status.error)
            pose = self._pose or self._requested()
            return [
                self._rates if name == "rates" else int(getattr(pose, name)) if name else 0 for name in self._counted
            ]
        except Exception as error:  # an exception here would be Fatal for the host
            self._report_defect(error)
            return [0] * len(vrs)

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        values = []
        for vr in vrs:
            name = self._references.name(vr)
            try:
                if name == "solver.ok":
                    values.append(bool(self._requested().status <= LAST_GOOD))
                elif name == "driven_by_time":
                    values.append(self._driven_by_time)
                else:
                    self.log(f"value reference {vr} is not a Boolean variable of this FMU", Fmi2Status.error)
                    values.append(False)
            except Exception as error:  # an exception here would be Fatal for the host
                self._report_defect(error)
                values.append(False)
        return values

    def get_string(self, vrs: Sequence[int]) -> list[str]:
        values = []
        for vr in vrs:
            known = self._references.name(vr) == "solver.message"
            if not known:
                self.log(f"value reference {vr} is not a String variable of this FMU", Fmi2Status.error)
            values.append(self._requested().message if known else "")
        return values

    # Set

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        inputs = self._inputs
        if (
            len(vrs) == 1 and vrs[0] == 1 and not (self._driven_by_time or self._refused)
        ):  # the value of the only driver
            value = values[0]
            if -LARGEST <= value <= LARGEST:
                if value != inputs[0]:
                    inputs[0] = value
                    self._pose = self._shown = self._motion = None
                elif not self._touched:
                    self._shown = self._motion = None
                self._touched = True
                return
        for vr, value in zip(vrs, values):  # noqa: B905  # the host's lists are equally long
            k = vr - 1
            if not (0 <= k < len(inputs) and -LARGEST <= value <= LARGEST):  # inputs come first
                self._set_other_real(vr, value)
                continue
            if value != inputs[k]:
                inputs[k] = value
                self._shown = self._motion = None
                if k % 3 == 0:
                    self._pose = None
                elif value != 0.0 and self._rates == Rates.AUTO:
                    self._wired.add(k)
            if self._refused:
                self._refused.pop(self._references.name(vr), None)
        if not self._touched:  # from here the rates are those at the current time, not at the commit
            self._touched = True
            self._shown = self._motion = None

    def _set_other_real(self, vr: int, value: float) -> None:
        """Set a parameter, which is rare, or refuse a value."""
        part, place = self._references.real(vr)
        kind = "" if part is None else self.layout.parts[part].name
        name = self._references.name(vr)
        if kind not in ("inputs", "constants", "parameters", "tolerance"):
            self._refuse(name or f"value reference {vr}", "is not a Real variable that can be set")
            return
        if not -LARGEST <= value <= LARGEST:
            why = f"is too large: at most {LARGEST:g} is taken" if math.isfinite(value) else "is not a finite number"
            self._refuse(name, f"= {value!r} {why}; {self.get_real([vr])[0]!r} stays")
            return
        if kind == "constants" and place in self.model.POSITIVE and not value > 0.0:
            self._refuse(name, f"= {value!r} must be positive; {self._constants[place]!r} stays")
            return
        if kind == "constants":
            self._constants = (*self._constants[:place], float(value), *self._constants[place + 1 :])
        elif kind == "parameters":
            if self._initialized:
                self._refuse(name, f"= {value!r} comes too late: it is fixed once the FMU is initialized")
                return
            self._parameters = (*self._parameters[:place], float(value), *self._parameters[place + 1 :])
            self._unbound = True
        elif value > 0.0:
            self._tolerance = self._solver.tolerance = float(value)
        else:
            self._refuse(name, f"= {value!r} must be positive; {self._tolerance!r} stays")
            return
        self._refused.pop(name, None)
        self._touched = True
        self._forget()

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self._references.name(vr)
            if name != "driven_by_time":
                self._refuse(name or f"value reference {vr}", "is not a Boolean variable that can be set")
            elif bool(value) == self._driven_by_time:
                self._refused.pop(name, None)
            elif self._initialized:
                self._refuse(name, f"= {bool(value)} comes too late: it is fixed once the FMU is initialized")
            else:
                self._driven_by_time = bool(value)
                self._forget()

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self._references.name(vr)
            if name != "rates":
                self._refuse(name or f"value reference {vr}", "is not an Integer variable that can be set")
            elif value not in tuple(Rates):
                modes = f"{Rates.AUTO} (auto), {Rates.ESTIMATED} (estimated) or {Rates.WIRED} (wired)"
                self._refuse(name, f"= {value} must be {modes}; {self._rates} stays")
            elif value == self._rates:
                self._refused.pop(name, None)
            elif self._initialized:
                self._refuse(name, f"= {value} comes too late: it is fixed once the FMU is initialized")
            else:
                self._refused.pop(name, None)
                self._choose_rates(value)

    def _choose_rates(self, rates: int) -> None:
        self._rates = rates
        rate_inputs = [k for k in range(len(self._inputs)) if k % 3]
        if rates == Rates.AUTO:
            self._wired = {k for k in rate_inputs if self._inputs[k] != 0.0}
        else:
            self._wired = set(rate_inputs) if rates == Rates.WIRED else set()
        self._forget()

    def set_string(self, vrs: Sequence[int], values: Sequence[str]) -> None:
        for vr, _ in zip(vrs, values, strict=True):
            self._refuse(self._references.name(vr) or f"value reference {vr}", "is not a String that can be set")

    def _refuse(self, name: str, why: str) -> None:
        """Report that a value is refused; the next doStep returns Discard, since a setter cannot return Error."""
        self._refused[name] = f"{name} {why}"
        self.log(self._refused[name], Fmi2Status.error)

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, *rest: Any, **more: Any) -> None:
        """Log a text with % and # doubled: in FMI 2.0 a message is a format, and #r1# stands for a variable."""
        super().log(msg.replace("%", "%%").replace("#", "##"), status, *rest, **more)

    def _report_defect(self, error: Exception) -> None:
        self.log(f"defect in the FMU: {type(error).__name__}: {error}", Fmi2Status.error)

    # Run

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

    def _bind(self) -> None:
        """Bind the parameters: continuation reaches the anchor, or every pose fails with the reason."""
        self._unbound = False
        self._solver = with_parameters(self.model, self._parameters, self._tolerance)
        self._committed = self._solver.anchor
        if isinstance(self._solver, UnsolvableModel):
            self.log(self._solver.message, Fmi2Status.error)

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
            if len(history) == KEPT and history[-1][0] < current_time - SAME_TIME * step_size - ROUNDING * abs(
                current_time
            ):  # the frequent case of _commit
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
        history = self._history
        same = t - SAME_TIME * step_size - ROUNDING * abs(t)
        while history and history[-1][0] >= same:  # the host repeats a step, or goes back
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
        return {
            "token": self.layout.token,
            "inputs": list(self._inputs),
            "constants": list(self._constants),
            "parameters": list(self._parameters),
            "tolerance": self._tolerance,
            "driven_by_time": self._driven_by_time,
            "rates": self._rates,
            "initialized": self._initialized,
            "running": self._running,
            "start_time": self._start_time,
            "time": self._time,
            "stop_time": self._stop_time,
            "touched": self._touched,
            "wired": sorted(self._wired),
            "refused": dict(self._refused),
            "stray_reported": self._stray_reported,
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
        self._inputs = list(_numbers(state["inputs"], self._inputs))
        self._constants = _numbers(state["constants"], self._constants)
        self._tolerance = float(state["tolerance"])
        self._driven_by_time = state["driven_by_time"]
        self._rates = state["rates"]
        self._initialized = state["initialized"]
        self._running = state["running"]
        self._start_time = state["start_time"]
        self._time = state["time"]
        self._stop_time = state["stop_time"]
        self._touched = state["touched"]
        self._wired = set(state["wired"])
        self._refused = dict(state["refused"])
        self._stray_reported = state["stray_reported"]
        self._parameters = _numbers(state["parameters"], self._parameters)
        self._unbound = False
        self._solver = with_parameters(self.model, self._parameters, self._tolerance)
        self._committed = self._solver.restore(state["committed"])
        self._committed_inputs = _numbers(state["committed_inputs"], self._inputs)
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
