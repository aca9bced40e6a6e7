"""The motion of the drivers of a slave: by inputs or by laws over time; by efforts, see efforts.py.

A motion decides which pose is requested, how fast the drivers move there, and what a step of the host does.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from ...solver.python import Pose, Solver, Status
from .base import Fmi2Status
from .estimated_rates import LARGEST, SAME_TIME, Sample, errors_of_estimated_rates, estimated_rate, estimated_rates
from .layout import NOT_A_NUMBER, Numbers

LAST_GOOD = int(Status.BRIDGED)  # compared in every read: faster than `Pose.good`
Drive = tuple[Numbers, Numbers, Numbers]  # u, ud, udd of the drivers


class Moved(Protocol):
    """What a motion needs of its slave; see there."""

    model: Any
    solver: Solver
    references: Any
    stages: Any
    settings: dict[str, Numbers]
    inputs: list[float]
    input_starts: list[float]
    wired: set[int]
    history: deque[Sample]
    committed: Pose
    committed_inputs: Numbers
    pose: Pose | None
    shown: Pose | None
    rows: dict[str, Numbers]
    time: float
    touched: bool
    stray_reported: bool
    requested: Callable[[], Pose]
    forget: Callable[[], None]
    commit: Callable[[Pose, float, float], None]
    discard: Callable[[Pose, float], bool]
    refuse: Callable[[str, str], None]
    log: Callable[..., None]


class ByInputs:
    """Motion by inputs: values, with speeds and accelerations that are inputs too, or estimated from the values."""

    def __init__(self, slave: Moved) -> None:
        self.slave = slave

    def setup(self, *rest: float | None) -> None:
        """Take what a host gives for the experiment after start and stop."""

    def begin(self, pose: Pose) -> None:
        """Take the pose at the end of initialization."""

    def forget(self) -> None:
        """Clear what is kept of the requested pose."""

    def dump(self) -> dict[str, Any]:
        """Return what belongs to the state of the FMU, as JSON has it."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Take the state from `dump`."""

    def is_set(self, part: str) -> None:
        """Clear what depends on a part of the variables of which one was set."""
        if part == "loads":
            rows = self.slave.rows
            self.slave.rows = {part: row for part, row in rows.items() if part not in self.slave.stages}
        else:
            self.slave.forget()

    def solve(self) -> Pose:
        """Return the requested pose, good or not, solved from the committed one."""
        slave = self.slave
        inputs = slave.inputs
        u = (inputs[0],) if len(inputs) == 3 else tuple(inputs[::3])  # most have one driver: no slice
        return slave.solver.solve(slave.committed, u)

    def drive(self) -> Drive:
        """Return u, ud, udd of the requested pose."""
        slave = self.slave
        history = slave.history
        if slave.touched or not history:
            t, u = slave.time, tuple(slave.inputs[::3])
        else:  # no set since the commit
            t, u = history[-1]
        if slave.wired or len(u) > 1:
            return self._with_rates(slave.inputs, t, u)
        ud, udd = estimated_rate(history, t, u[0])
        return u, ud, udd

    def committed_drive(self) -> Drive:
        """Return u, ud, udd at the last commit."""
        return self._with_rates(self.slave.committed_inputs, *self.slave.history[-1])

    def errors(self) -> tuple[Numbers, Numbers] | None:
        """Return the errors of ud and udd, which estimates have; None: the motion has none."""
        slave = self.slave
        t = self.sample_time(is_stale=False)
        speeds, accelerations = errors_of_estimated_rates(slave.history, t, tuple(slave.inputs[::3]))
        wired = slave.wired
        return (
            tuple([0.0 if 3 * k + 1 in wired else error for k, error in enumerate(speeds)]),
            tuple([0.0 if 3 * k + 2 in wired else error for k, error in enumerate(accelerations)]),
        )

    def sample_time(self, *, is_stale: bool) -> float:
        """Return the time of the sample that is shown, which is the last good one if `is_stale`."""
        slave = self.slave
        return slave.history[-1][0] if slave.history and (is_stale or not slave.touched) else slave.time

    def step(self, t: float, h: float) -> bool:
        """Commit the pose at the inputs, with t as its time."""
        slave = self.slave
        pose = slave.pose
        if pose is None:
            pose = slave.pose = self.solve()
        if pose.status > LAST_GOOD:
            return slave.discard(pose, t)
        if not slave.touched or t != slave.time:
            slave.shown = None  # the time of the rates changes: inputs are held, or clocks differ
        slave.commit(pose, t, h)
        slave.time = t + h
        return True

    def _with_rates(self, inputs: Sequence[float], t: float, u: Numbers) -> Drive:
        """Return u, ud, udd at a time and u, with estimates for rates that are not wired."""
        wired, history = self.slave.wired, self.slave.history
        if len(wired) == 2 * len(u):
            return u, tuple(inputs[1::3]), tuple(inputs[2::3])
        ud, udd = estimated_rates(history, t, u)
        if wired:
            ud = tuple([inputs[k] if k in wired else ud[k // 3] for k in range(1, len(inputs), 3)])
            udd = tuple([inputs[k] if k in wired else udd[k // 3] for k in range(2, len(inputs), 3)])
        return u, ud, udd


class ByLaw(ByInputs):
    """Motion by the laws in the mechanism's file, over time; inputs have no effect."""

    def solve(self) -> Pose:
        return self._solved(self.slave.committed, self.slave.time)

    def drive(self) -> Drive:
        return self._at(self.slave.time)

    def committed_drive(self) -> Drive:
        return self._at(self.slave.history[-1][0])

    def errors(self) -> None:
        return None

    def sample_time(self, *, is_stale: bool) -> float:  # noqa: ARG002  # the time of the communication point
        return self.slave.time

    def step(self, t: float, h: float) -> bool:
        """Commit the pose at the end of a step, reached from the pose at its start."""
        slave = self.slave
        if slave.inputs != slave.input_starts and not slave.stray_reported:
            self._warn_of_inputs()
        is_committed = slave.history and not slave.touched and abs(t - slave.history[-1][0]) <= SAME_TIME * h
        pose = slave.committed if is_committed else self._solved(slave.committed, t)
        slave.time = t
        if pose.good:
            slave.time = t + h
            pose = self._solved(pose, slave.time)
        slave.forget()
        slave.pose = pose
        if not pose.good:
            return slave.discard(pose, slave.time)
        slave.commit(pose, slave.time, h)
        return True

    def _at(self, t: float) -> Drive:
        return self.slave.solver.model.drive(t, self.slave.settings["constants"])  # type: ignore[no-any-return]

    def _solved(self, start: Pose, t: float) -> Pose:
        """Return the pose at time t; it has no solution if a rate exceeds LARGEST."""
        u, ud, udd = self._at(t)
        is_usable = all(-LARGEST <= rate <= LARGEST for rate in ud + udd)
        return self.slave.solver.solve(start, u if is_usable else (NOT_A_NUMBER,) * len(u))

    def _warn_of_inputs(self) -> None:
        """Warn once that inputs were set although time drives."""
        slave = self.slave
        slave.stray_reported = True
        pairs = zip(slave.inputs, slave.input_starts, strict=True)
        first = next(k for k, (value, start) in enumerate(pairs) if value != start)
        name = slave.references.name(first + 1)  # inputs come first
        slave.log(
            f"{name} was set, but driven_by_time is true: the law drives, inputs have no effect", Fmi2Status.warning
        )
