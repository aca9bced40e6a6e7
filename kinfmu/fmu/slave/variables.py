"""The variables of a slave: what a get computes, and what a set changes after it was checked."""

from __future__ import annotations

import math
import sys
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import Any, ClassVar

from ...solver.python import Pose, Status, UnsolvableModel, with_parameters
from ...solver.python.solver import LEAST_TOLERANCE, MOST_TOLERANCE
from ...solver.python.tracks import sample_rates
from .base import Fmi2Slave, Fmi2Status
from .estimated_rates import LARGEST, SAMPLES, Rates, Sample
from .layout import MOTION, NOT_A_NUMBER, UNKNOWN_ERROR, Computer, Fetch, Layout, Numbers, Places, plan_fetch
from .motion import LAST_GOOD, ByInputs, ByLaw, Drive

MOST_FETCHES = 256  # lists of value references kept, so that a host that reads at random does not fill the memory
SETTINGS = ("constants", "parameters", "tolerance", "loads", "efforts")  # parts that are read as they are set
_LATE = {  # why a set after initialization is refused, by part
    "parameters": "it is fixed once the FMU is initialized",
    "states": "it is a state, which the FMU integrates once it is initialized",
}


class SlaveVariables(Fmi2Slave):  # type: ignore[misc]  # pythonfmu carries no types
    """The state of a slave, its getters and setters.

    What is computed is cached until a set or a step changes it. A refused value is logged, and the next doStep is
    Discard. A subclass may define `stages` of forces (emitted, by part), `positive` (names of the constants of loads'
    laws that must be positive) and, if loads need a direction, `distances` (emitted) of their ends with a message for
    each in `meeting`; and `by_efforts`, which makes the motion of an FMU that efforts drive.
    """

    __slots__ = (  # in the dictionary, with those of pythonfmu, they would be too many for Python's fastest access
        *("_computers", "_counts", "_fetch", "_fetches", "_input_count", "_shown_drive", "committed"),
        *("committed_inputs", "committed_loads", "driven_by_time", "history", "initialized", "input_starts", "inputs"),
        *("motion", "pose", "rates", "references", "refused", "rows", "running", "settings", "shown", "solver"),
        *("start_time", "stop_time", "stray_reported", "time", "touched", "unbound", "wired"),
    )
    model: ClassVar[Any]
    layout: ClassVar[Layout]
    stages: ClassVar[dict[str, Callable[..., Numbers]]] = {}
    distances: Callable[..., Numbers]
    meeting: ClassVar[tuple[str, ...]] = ()
    positive: ClassVar[tuple[str, ...]] = ()
    by_efforts: ClassVar[Callable[..., ByInputs] | None] = None

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        starts = {part.name: part.starts for part in self.layout.parts}
        # Value, speed, acceleration of each driver; 0.0 added to a state makes 0 of -0.
        driven = [x + 0.0 for x in starts["states"]] if self.by_efforts else starts["inputs"]
        self.inputs: list[float] = list(driven)
        self.input_starts = list(self.inputs)
        self._input_count = 0 if self.by_efforts else len(self.inputs)  # of drivers, which come first
        self.settings: dict[str, Numbers] = {part: starts.get(part, ()) for part in SETTINGS}
        self.driven_by_time: bool = starts.get("drive", (False,))[0]
        self.rates: int = starts.get("rate_source", (Rates.WIRED,))[0]
        self.references = Places(self.layout)
        self._counts = {self.references.number(f"solver.{name}"): attrgetter(name) for name in ("status", "iterations")}
        self._computers = self._computed()
        self._fetches: dict[tuple[int, ...], Fetch] = {}
        self._fetch = plan_fetch(self.references, (), self._computers)  # the last one
        self.solver = with_parameters(self.model, self.settings["parameters"], self.settings["tolerance"][0])
        self.unbound = False  # parameters were set and are not yet bound

        self.initialized = False
        self.running = False  # from the end of initialization to terminate
        self.start_time = self.layout.start_time
        self.time = self.layout.start_time  # the communication point, or the point that a failed step asked for
        self.stop_time = sys.float_info.max  # of the experiment, if the host gave one
        self.touched = False  # something was set since the last commit
        self.wired: set[int] = set()  # places of the inputs that are used as rates, in place of estimates
        self.refused: dict[str, str] = {}  # by variable: why a value was refused; the next doStep is Discard
        self.stray_reported = False  # the host was warned that inputs have no effect

        self.committed: Pose = self.solver.anchor
        self.committed_inputs: Numbers = tuple(self.inputs)
        self.committed_loads = self.settings["loads"]
        self.history: deque[Sample] = deque(maxlen=SAMPLES)  # the last commits, oldest first
        self.motion = self.new_motion()
        self.forget()
        self.rows: dict[str, Numbers] = {}  # what has been computed at the shown pose so far, by part
        self._shown_drive: Drive | None = None  # u, ud, udd of the shown pose

    def new_motion(self) -> ByInputs:
        """Return the motion of the drivers."""
        if self.by_efforts:
            self.wired = {k for k in range(len(self.inputs)) if k % 3}  # all rates are known
            return self.by_efforts(self)
        return ByLaw(self) if self.driven_by_time else ByInputs(self)

    # The requested pose and its cache

    def forget(self) -> None:
        """Clear the cache, since driver values may have changed: the next get solves."""
        self.pose: Pose | None = None
        self.shown: Pose | None = None
        self.motion.forget()

    def requested(self) -> Pose:
        """Return the requested pose, good or not, solved from the committed one."""
        pose = self.pose
        if pose is None:
            if self.unbound:
                self.bind()
            pose = self.pose = self.motion.solve()
        return pose

    def _is_stale(self) -> bool:
        """Return whether the last good pose is shown, in place of an unreachable requested one."""
        return self.shown is not self.pose

    def _drive(self) -> Drive:
        """Return u, ud, udd of the shown pose; before the first commit the last good one is at rest."""
        drive = self._shown_drive
        if drive is None:
            if self.shown is self.pose:
                drive = self.motion.drive()
            elif self.history:
                drive = self.motion.committed_drive()
            else:
                rest = (0.0,) * len(self.committed.u)
                drive = self.committed.u, rest, rest
            self._shown_drive = drive
        return drive

    # Parts of the list of variables, each computed when it is first read

    def _computed(self) -> dict[str, Computer]:
        """Return the functions that compute parts, by name; other parts are read as they are set."""
        names = ("states", "driven", *MOTION, "motion", "residual", "margin", "errors", "watch", "fixed", "no_number")
        return {part: getattr(self, f"_{part}") for part in names} | {
            stage: partial(self._stage, stage) for stage in self.stages
        }

    def _states(self, _: Pose) -> Numbers:
        return sum(zip(*self._drive()), ())  # noqa: B905  # faster without

    def _driven(self, _: Pose) -> Numbers:
        drive = self.motion.drive() if self._is_stale() else self._drive()
        return sum(zip(*drive), ())  # noqa: B905

    def _values(self, pose: Pose) -> Numbers:
        return self.solver.outputs(pose)

    def _rates(self, pose: Pose) -> Numbers:
        return self.solver.rates(pose, self._drive()[1])

    def _accelerations(self, pose: Pose) -> Numbers:
        return self.solver.accelerations(pose, *self._drive()[1:])

    def _motion(self, pose: Pose) -> Numbers:
        """Return values, rates and accelerations in one row: common subexpressions are computed once."""
        rows = self.rows
        if not rows or ("values" not in rows and "rates" not in rows):
            _, ud, udd = self._drive()
            return self.solver.motion(pose, ud, udd)
        return sum([rows.get(part) or self._computers[part](pose) for part in MOTION], ())  # some were read before

    def _residual(self, _: Pose) -> Numbers:
        return (self.requested().residual,)

    def _margin(self, _: Pose) -> Numbers:
        return (self.solver.margin(self.requested()),)  # not computed with the pose: it takes longer than a pose

    def _errors(self, pose: Pose) -> Numbers:
        _, ud, udd = self._drive()
        errors = self.solver.errors(pose, ud, udd, None if self._is_stale() else self.motion.errors())
        return tuple([min(error, UNKNOWN_ERROR) for error in errors])

    def _no_number(self, _: Pose) -> Numbers:
        return (NOT_A_NUMBER,)

    def _watch(self, pose: Pose) -> Numbers:
        return self.solver.watch(pose)

    def _fixed(self, _: Pose) -> Numbers:
        return tuple(self.solver.model.FIXED.values())  # parameters are bound

    def _stage(self, stage: str, pose: Pose) -> Numbers:
        """Return forces, reactions or shaking forces."""
        try:
            return self._forces(stage, pose)
        except (ArithmeticError, ValueError) as error:  # a law of a load without a value
            self.log(f"forces have no value: {error}", Fmi2Status.warning)
            return self._unknown(stage)

    def _unknown(self, stage: str) -> Numbers:
        return next((NOT_A_NUMBER,) * len(part.variables) for part in self.layout.parts if part.name == stage)

    def _forces(self, stage: str, pose: Pose) -> Numbers:
        if stage == "reactions" and pose.status >= Status.BRIDGED:  # the blocks do not give them there
            return self._unknown(stage)
        u, ud, udd = self._drive()
        zd, zdd, slopes = sample_rates(self.solver.model, pose, ud, udd)
        time = self.motion.sample_time(is_stale=self._is_stale())
        loads = self.committed_loads if self._is_stale() else self.settings["loads"]
        sample = (time, u, ud, udd, pose.z, zd, zdd, slopes, loads, self.settings["parameters"])
        forces = self.stages[stage](*sample)
        if self.meeting and any(map(math.isnan, forces)):
            for message, distance in zip(self.meeting, self.distances(*sample), strict=True):
                if distance == 0.0:
                    self.log(message, Fmi2Status.warning)
        return forces

    # Get

    def _plan_fetch(self, vrs: tuple[int, ...]) -> Fetch:
        """Return how a list of Real value references is read, and keep it."""
        for vr in vrs:
            if self.references.real(vr)[0] is None:
                self.log(f"value reference {vr} is not a Real variable of this FMU", Fmi2Status.error)
        if len(self._fetches) >= MOST_FETCHES:
            self._fetches.clear()
        fetch = self._fetches[vrs] = plan_fetch(self.references, vrs, self._computers)
        return fetch

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        try:
            references, parts, pick = self._fetch
            if vrs != references:  # most hosts read the same list over and over
                key = tuple(vrs)
                _, parts, pick = self._fetch = self._fetches.get(key) or self._plan_fetch(key)
            row: Numbers = ()
            for part, compute in parts:
                if compute is None:
                    row += tuple(self.inputs) if part == "inputs" else self.settings[part]
                    continue
                shown = self.shown
                if shown is None:  # the requested pose if it is good, else the last good one
                    pose = self.pose or self.requested()
                    shown = self.shown = self.committed if pose.status > LAST_GOOD else pose
                    self.rows, self._shown_drive = {}, None
                numbers = self.rows.get(part)
                if numbers is None:
                    numbers = self.rows[part] = compute(shown)
                row += numbers
            return list(pick(row) if pick else row)
        except Exception as error:  # an exception here would be Fatal for the host
            self.report_defect(error)
            return [NOT_A_NUMBER] * len(vrs)

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        try:
            pose, counts = self.pose or self.requested(), self._counts
            return [counts[vr](pose) if vr in counts else self._rates_of(vr) for vr in vrs]
        except Exception as error:  # an exception here would be Fatal for the host
            self.report_defect(error)
            return [0] * len(vrs)

    def _rates_of(self, vr: int) -> int:
        """Return the parameter `rates`, the only Integer that no pose has."""
        if self.references.name(vr) == "rates":
            return self.rates
        self.log(f"value reference {vr} is not an Integer variable of this FMU", Fmi2Status.error)
        return 0

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        values = []
        for vr in vrs:
            name = self.references.name(vr)
            try:
                if name == "solver.ok":
                    values.append(bool(self.requested().status <= LAST_GOOD))
                elif name == "driven_by_time":
                    values.append(self.driven_by_time)
                else:
                    self.log(f"value reference {vr} is not a Boolean variable of this FMU", Fmi2Status.error)
                    values.append(False)
            except Exception as error:  # an exception here would be Fatal for the host
                self.report_defect(error)
                values.append(False)
        return values

    def get_string(self, vrs: Sequence[int]) -> list[str]:
        values = []
        for vr in vrs:
            is_message = self.references.name(vr) == "solver.message"
            if not is_message:
                self.log(f"value reference {vr} is not a String variable of this FMU", Fmi2Status.error)
            values.append(self.requested().message if is_message else "")
        return values

    # Set

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        inputs = self.inputs
        pairs = ((vrs[0], values[0]),) if len(vrs) == 1 else zip(vrs, values)  # noqa: B905  # the lists are equally long
        for vr, value in pairs:
            if not (0 < vr <= self._input_count and -LARGEST <= value <= LARGEST):
                self._set_real(vr, value)
                continue
            k = vr - 1
            if value != inputs[k]:
                inputs[k] = value
                self.shown = None
                if k % 3 == 0:
                    self.pose = None
                elif value != 0.0 and self.rates == Rates.AUTO:
                    self.wired.add(k)
            if self.refused:
                self.refused.pop(self.references.name(vr), None)
        if not self.touched:  # from here the rates are those at the current time, not at the commit
            self.touched = True
            self.shown = None

    def _set_real(self, vr: int, value: float) -> None:
        """Set anything but an input of a driver, or refuse a value."""
        part, place = self.references.real(vr)
        name, kind = self.references.name(vr), "" if part is None else self.layout.parts[part].name
        objection = self._objection(vr, kind, place, value)
        if objection:
            self.refuse(name or f"value reference {vr}", objection)
            return
        if kind == "states":
            self.inputs[place] = float(value)
        else:
            before = self.settings[kind]
            self.settings[kind] = (*before[:place], float(value), *before[place + 1 :])
        if kind == "parameters":
            self.unbound = True
        elif kind == "tolerance" and not place:
            self.solver.tolerance = float(value)
        self.motion.is_set(kind)
        self.refused.pop(name, None)

    def _objection(self, vr: int, kind: str, place: int, value: float) -> str:
        """Return why a number cannot be set, or an empty text; kind: the part that the variable belongs to."""
        if kind not in (*SETTINGS, "inputs", "states") or (kind == "states" and place % 3 == 2):
            return "is not a Real variable that can be set"
        is_positive = (
            self.references.name(vr) in self.positive
            or (kind == "constants" and place in self.model.POSITIVE)
            or (kind == "tolerance" and not place)
        )
        if not -LARGEST <= value <= LARGEST:
            why = f"is too large: at most {LARGEST:g} is taken" if math.isfinite(value) else "is not a finite number"
        elif is_positive and not value > 0.0:
            why = "must be positive"
        elif kind == "tolerance" and place and not LEAST_TOLERANCE <= value <= MOST_TOLERANCE:
            why = f"must be {LEAST_TOLERANCE:g} to {MOST_TOLERANCE:g}"
        else:
            return f"= {value!r} comes too late: {_LATE[kind]}" if kind in _LATE and self.initialized else ""
        return f"= {value!r} {why}; {self.get_real([vr])[0]!r} stays"

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self.references.name(vr)
            if name != "driven_by_time":
                self.refuse(name or f"value reference {vr}", "is not a Boolean variable that can be set")
            elif bool(value) == self.driven_by_time:
                self.refused.pop(name, None)
            elif self.initialized:
                self.refuse(name, f"= {bool(value)} comes too late: it is fixed once the FMU is initialized")
            else:
                self.driven_by_time = bool(value)
                self.motion = self.new_motion()
                self.forget()

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self.references.name(vr)
            if name != "rates":
                self.refuse(name or f"value reference {vr}", "is not an Integer variable that can be set")
            elif value not in tuple(Rates):
                modes = f"{Rates.AUTO} (auto), {Rates.ESTIMATED} (estimated) or {Rates.WIRED} (wired)"
                self.refuse(name, f"= {value} must be {modes}; {self.rates} stays")
            elif value == self.rates:
                self.refused.pop(name, None)
            elif self.initialized:
                self.refuse(name, f"= {value} comes too late: it is fixed once the FMU is initialized")
            else:
                self.refused.pop(name, None)
                self._choose_rates(value)

    def _choose_rates(self, rates: int) -> None:
        self.rates = rates
        rate_inputs = [k for k in range(len(self.inputs)) if k % 3]
        if rates == Rates.AUTO:
            self.wired = {k for k in rate_inputs if self.inputs[k] != 0.0}
        else:
            self.wired = set(rate_inputs) if rates == Rates.WIRED else set()
        self.forget()

    def set_string(self, vrs: Sequence[int], values: Sequence[str]) -> None:
        for vr, _ in zip(vrs, values, strict=True):
            self.refuse(self.references.name(vr) or f"value reference {vr}", "is not a String that can be set")

    # Messages and parameters

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, *rest: Any, **more: Any) -> None:
        """Log a text with % and # doubled: in FMI 2.0 a message is a format, and #r1# stands for a variable."""
        super().log(msg.replace("%", "%%").replace("#", "##"), status, *rest, **more)

    def report_defect(self, error: Exception) -> None:
        self.log(f"defect in the FMU: {type(error).__name__}: {error}", Fmi2Status.error)

    def refuse(self, name: str, why: str) -> None:
        """Report that a value is refused; the next doStep returns Discard, since a setter cannot return Error."""
        self.refused[name] = f"{name} {why}"
        self.log(self.refused[name], Fmi2Status.error)

    def bind(self) -> None:
        """Bind the parameters: continuation reaches the anchor, or every pose fails with the reason."""
        self.unbound = False
        self.solver = with_parameters(self.model, self.settings["parameters"], self.settings["tolerance"][0])
        self.committed = self.solver.anchor
        if isinstance(self.solver, UnsolvableModel):
            self.log(self.solver.message, Fmi2Status.error)
