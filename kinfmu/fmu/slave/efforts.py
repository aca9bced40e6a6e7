"""The motion of drivers under efforts, which are inputs; values and speeds are states.

    J(u) udd = T - bias(u, ud)        u: driver values, T: efforts, J: reduced inertia

Efforts and external loads hold during a step of the host, and act at once: a get after a set has the new accelerations.
A step that passes a limit is discarded, and states and pose stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ...solver.python import Pose, Status
from ...solver.python.pose import failed
from ...solver.python.solver import LEAST_TOLERANCE, MOST_TOLERANCE
from ...solver.python.torque import Course, DormandPrince, Ended, EquationOfMotion, Given, Laws, TorqueSteps
from .base import Fmi2Status
from .layout import Numbers
from .motion import ByInputs, Drive, Moved

_UNDETERMINED = "the reduced inertia is singular, or a number is not finite"


class ByEfforts(ByInputs):
    """Motion by efforts.

    Args:
        slave: The slave, whose `inputs` are the states: value, speed and acceleration of each driver.
        inertia: Emitted: bias efforts and reduced inertia.
        jumps: Emitted: jumps of loads over time.
        laws: Emitted: arguments and breaks of laws over quantities.
        law_counts: How many breaks each of them has.
        in_si: Units of the drivers.

    """

    _udd: Numbers | None = None  # accelerations of the drivers at the requested pose
    _ended: Ended | None = None  # why the last step was discarded

    def __init__(
        self,
        slave: Moved,
        *,
        inertia: Callable[..., Numbers],
        jumps: Callable[[Numbers, Numbers], Sequence[tuple[float, float]]],
        laws: Callable[..., Numbers],
        law_counts: tuple[int, ...],
        in_si: Numbers,
    ) -> None:
        super().__init__(slave)
        self._jumps = jumps
        self._laws = laws
        self._law_counts = law_counts
        self._equation = EquationOfMotion(inertia, in_si)
        self._step_size = 0.0  # that the integrator would take next, 0 at the start

    def setup(self, *rest: float | None) -> None:
        tolerance = rest[0] if rest else None
        if tolerance is not None and tolerance > 0.0:
            of_solver = self.slave.settings["tolerance"][0]
            self.slave.settings["tolerance"] = of_solver, min(max(tolerance, LEAST_TOLERANCE), MOST_TOLERANCE)

    def begin(self, pose: Pose) -> None:
        slave = self.slave
        udd = self._accelerations(pose)
        if udd is not None:
            self._commit(pose, slave.time, 0.0, udd)
            return
        ud = tuple(slave.inputs[1::3])
        massless = self._equation.massless(slave.solver, pose, slave.time, ud, self._given())
        driver = slave.model.DRIVERS[massless[0] if massless else 0]
        slave.refuse(
            "initialization",
            f"fails: driver {driver}: its reduced inertia is 0, so that efforts do not determine its motion; "
            "give a body that it moves a mass or an inertia",
        )

    def forget(self) -> None:
        self._udd = self._ended = None

    def solve(self) -> Pose:
        committed = self.slave.committed
        return committed if self.slave.history and tuple(self.slave.inputs[::3]) == committed.u else super().solve()

    def drive(self) -> Drive:
        slave = self.slave
        if self._udd is None:
            self._udd = self._accelerations(slave.requested())
            if self._udd is None:
                slave.refuse("accelerations", f"have no value: {_UNDETERMINED}")
                self._udd = slave.committed_inputs[2::3]
            slave.inputs[2::3] = self._udd
        return tuple(slave.inputs[::3]), tuple(slave.inputs[1::3]), self._udd

    def step(self, t: float, h: float) -> bool:
        """Integrate over a step: states and pose at both of its ends are committed."""
        slave = self.slave
        if self._ended is not None:
            slave.forget()
        slave.time = t
        pose = slave.requested()
        if not pose.good:
            return slave.discard(pose, t)
        udd = self._accelerations(pose)
        if udd is None:
            slave.log(f"at t = {t:g} s: {_UNDETERMINED}", Fmi2Status.discard)
            return False
        self._commit(pose, t, h, udd)
        given, ud = self._given(), tuple(slave.inputs[1::3])

        def accelerations(at: float, pose: Pose, ud: Numbers) -> Numbers | None:
            return self._equation.accelerations(slave.solver, pose, at, ud, given)

        def law_numbers(pose: Pose) -> Numbers:
            return self._laws(0.0, pose.u, (), (), pose.z, (), (), (), given.loads, given.parameters)

        integrator = DormandPrince(slave.settings["tolerance"][1], self._step_size)
        steps = TorqueSteps(Course(slave.solver, accelerations), integrator, Laws(self._law_counts, law_numbers))
        at = steps.run(pose, ud, t, t + h, self._jumps(given.loads, given.parameters))
        if steps.ended is not None:
            slave.forget()
            self._end(steps.ended)
            return slave.discard(slave.requested(), steps.ended.t)
        if at is not None:  # else the step has no length
            self._step_size = integrator.size if integrator.size < math.inf else 0.0
            d = len(ud)
            slave.inputs[0::3], slave.inputs[1::3] = at.y[:d], at.y[d:]
            pose = at.pose
        slave.time = t + h
        self._commit(pose, slave.time, h, self._accelerations(pose))
        return True

    def _commit(self, pose: Pose, t: float, h: float, udd: Numbers | None) -> None:
        """Commit states and pose."""
        slave = self.slave
        if udd is not None:
            slave.inputs[2::3] = udd
        slave.commit(pose, t, h)
        slave.shown, slave.pose, self._udd = None, pose, udd

    def _end(self, ended: Ended) -> None:
        """Show why a motion ended: the requested pose is past its end."""
        self._ended = ended
        self.slave.pose = failed(self.slave.committed, ended.u, Status(ended.status), ended.message)

    def _given(self) -> Given:
        settings = self.slave.settings
        return Given(settings["efforts"], settings["loads"], settings["parameters"])

    def _accelerations(self, pose: Pose) -> Numbers | None:
        """Return the accelerations of the drivers at a pose now."""
        slave = self.slave
        ud = tuple(slave.inputs[1::3])
        return self._equation.accelerations(slave.solver, pose, slave.time, ud, self._given())

    def is_set(self, part: str) -> None:
        """Clear what depends on a part; efforts and loads change accelerations and forces, but not the pose."""
        if part not in ("efforts", "loads") or self._ended is not None:
            self.slave.forget()
        self.slave.shown = self._udd = None

    def dump(self) -> dict[str, Any]:
        return {"step_size": self._step_size, "ended": None if self._ended is None else list(self._ended)}

    def restore(self, state: dict[str, Any]) -> None:
        self._step_size = float(state["step_size"])
        if state["ended"] is not None:
            t, u, status, message = state["ended"]
            self._end(Ended(t, tuple(u), status, message))
