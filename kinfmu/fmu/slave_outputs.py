"""The outputs of a slave: the requested pose and what is computed from it. The FMU has a copy: see slave.py."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from kinfmu.fmu.estimated_rates import LARGEST, Rates, Sample, errors_of_estimated_rates, estimated_rates
from kinfmu.fmu.layout import NOT_A_NUMBER, UNKNOWN_ERROR, Fetch, Layout, Numbers, Places, plan_fetch
from kinfmu.solver.python import Pose, Status, UnsolvableModel, with_parameters

LAST_GOOD = int(Status.BRIDGED)  # compared in every read: faster than `Pose.good`
MOST_FETCHES = 256  # lists of value references kept, so that a host that reads at random does not fill the memory
_COUNTS = {"solver.status": "status", "solver.iterations": "iterations", "rates": "rates"}  # all but rates: of a pose


class Shown:
    """The pose that outputs are read from, with what has been computed from it so far.

    drive: u, ud, udd of the drivers; stale: true for the last good pose, in place of an unreachable requested one.
    """

    __slots__ = ("accelerations", "drive", "errors", "pose", "rates", "stale", "values")

    def __init__(self, pose: Pose, stale: bool) -> None:
        self.pose = pose
        self.stale = stale
        self.drive: tuple[Numbers, Numbers, Numbers] | None = None
        self.values: Numbers | None = None
        self.rates: Numbers | None = None
        self.accelerations: Numbers | None = None
        self.errors: Numbers | None = None


class SlaveOutputs(Fmi2Slave):  # type: ignore[misc]  # pythonfmu carries no types
    """The state of a slave and its getters; what is computed is cached until a set or a step changes it."""

    model: ClassVar[Any]
    layout: ClassVar[Layout]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        parts = {part.name: part for part in self.layout.parts}
        moving = parts["inputs" if "inputs" in parts else "states"]  # states: see torque_slave.py
        self._inputs: list[float] = list(moving.starts)  # value, speed, acceleration of each driver
        self._input_starts = list(self._inputs)
        self._constants: Numbers = parts["constants"].starts
        self._parameters: Numbers = parts["parameters"].starts
        self._tolerance: float = parts["tolerance"].starts[0]
        self._driven_by_time: bool = "drive" in parts and parts["drive"].starts[0]
        self._rates: int = parts["rate_source"].starts[0] if "rate_source" in parts else Rates.WIRED
        self._references = Places(self.layout)
        self._fetches: dict[tuple[int, ...], Fetch] = {}
        self._last_read: list[int] = []  # value references of the last get_real
        self._last_fetch = self._plan_fetch(())
        self._motion_drive: tuple[Numbers, Numbers, Numbers] = ((), (), ())  # u, ud, udd of `_motion`
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
        self._committed_inputs: Numbers = tuple(self._inputs)
        self._history: tuple[Sample, ...] = ()  # the last commits, KEPT at most, oldest first

        self._forget()

    # The requested pose and its cache

    def _forget(self) -> None:
        """Clear the cache, since driver values may have changed: the next get solves."""
        self._pose: Pose | None = None
        self._shown: Shown | None = None
        self._motion: Numbers | None = None  # values, rates and accelerations in one row, which most hosts read

    def _driven(self) -> tuple[Numbers, Numbers, Numbers]:
        """Return the requested u, ud, udd: by the law at the current time, or by the inputs."""
        if self._driven_by_time:
            return self._solver.model.drive(self._time, self._constants)  # type: ignore[no-any-return]
        t, u = self._moment()
        if self._wired:
            return self._by_inputs(self._inputs, t, u)
        return u, *estimated_rates(self._history, t, u)

    def _law(self, t: float) -> Numbers:
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

    def _by_inputs(self, inputs: Sequence[float], t: float, u: Numbers) -> tuple[Numbers, Numbers, Numbers]:
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

    def _committed_drive(self) -> tuple[Numbers, Numbers, Numbers]:
        """Return u, ud, udd at the last commit, of the last good values; before it, those of the anchor at rest."""
        if not self._history:
            rest = (0.0,) * len(self._committed.u)
            return self._committed.u, rest, rest
        t, u = self._history[-1]
        if self._driven_by_time:
            return self._solver.model.drive(t, self._constants)  # type: ignore[no-any-return]
        return self._by_inputs(self._committed_inputs, t, u)

    def _wanted(self) -> Numbers:
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

    def _drive(self, shown: Shown) -> tuple[Numbers, Numbers, Numbers]:
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

    def _read_inputs(self) -> Numbers:
        return tuple(self._inputs)

    def _read_values(self) -> Numbers:
        shown = self._look()
        if shown.values is None:
            shown.values = self._solver.outputs(shown.pose)
        return shown.values

    def _read_rates(self) -> Numbers:
        shown = self._look()
        if shown.rates is None:
            shown.rates = self._solver.rates(shown.pose, self._drive(shown)[1])
        return shown.rates

    def _read_accelerations(self) -> Numbers:
        shown = self._look()
        if shown.accelerations is None:
            _, ud, udd = self._drive(shown)
            shown.accelerations = self._solver.accelerations(shown.pose, ud, udd)
        return shown.accelerations

    def _read_motion(self) -> Numbers:
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

    def _read_residual(self) -> Numbers:
        return (self._requested().residual,)

    def _read_margin(self) -> Numbers:
        return (self._solver.margin(self._requested()),)  # not computed with the pose: it takes longer than a pose

    def _read_errors(self) -> Numbers:
        shown = self._look()
        if shown.errors is None:
            _, ud, udd = self._drive(shown)
            off = None if shown.stale or self._driven_by_time else self._errors_of_drive()
            errors = self._solver.errors(shown.pose, ud, udd, off)
            shown.errors = tuple([min(error, UNKNOWN_ERROR) for error in errors])
        return shown.errors

    def _errors_of_drive(self) -> tuple[Numbers, Numbers]:
        """Return the errors of ud and udd: those of estimates from samples; inputs have none."""
        speeds, accelerations = errors_of_estimated_rates(self._history, *self._moment())
        wired = self._wired
        return (
            tuple([0.0 if 3 * k + 1 in wired else error for k, error in enumerate(speeds)]),
            tuple([0.0 if 3 * k + 2 in wired else error for k, error in enumerate(accelerations)]),
        )

    def _read_watch(self) -> Numbers:
        return self._solver.watch(self._look().pose)

    def _read_driven(self) -> Numbers:
        shown = self._look()
        drive = self._driven() if shown.stale else self._drive(shown)
        if len(drive[0]) == 1:
            return drive[0] + drive[1] + drive[2]
        return tuple(value for driver in zip(*drive, strict=True) for value in driver)

    def _read_constants(self) -> Numbers:
        return self._constants

    def _read_tolerance(self) -> Numbers:
        return (self._tolerance,)

    def _read_parameters(self) -> Numbers:
        return self._parameters

    def _read_fixed(self) -> Numbers:
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

    # Messages and parameters

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, *rest: Any, **more: Any) -> None:
        """Log a text with % and # doubled: in FMI 2.0 a message is a format, and #r1# stands for a variable."""
        super().log(msg.replace("%", "%%").replace("#", "##"), status, *rest, **more)

    def _report_defect(self, error: Exception) -> None:
        self.log(f"defect in the FMU: {type(error).__name__}: {error}", Fmi2Status.error)

    def _bind(self) -> None:
        """Bind the parameters: continuation reaches the anchor, or every pose fails with the reason."""
        self._unbound = False
        self._solver = with_parameters(self.model, self._parameters, self._tolerance)
        self._committed = self._solver.anchor
        if isinstance(self._solver, UnsolvableModel):
            self.log(self._solver.message, Fmi2Status.error)
