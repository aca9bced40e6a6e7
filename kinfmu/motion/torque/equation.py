"""Equation of motion of a mechanism in its drivers, evaluated at one state after another.

    J(u) udd = T - bias(u, ud)

The pose is followed from the last one by the solver. Reduced inertia J and bias effort follow from one motion with
accelerations of 0, and from the velocity coefficients K = dq/du, which are the rates at unit speeds: on a bridge these
are interpolated, where the blocks are singular.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.codegen.python.stage import load_stage
from kinfmu.errors import RequestError, listed
from kinfmu.motion.torque.efforts import Efforts, State
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import effort_noun, force_names, force_steps
from kinfmu.plan.led_laws import led_laws
from kinfmu.plan.steps import derivative_name, law_symbol
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Vector
from kinfmu.units import METRES


class Inertia(NamedTuple):
    """Reduced inertia (d, d) and bias efforts (d,), in SI units."""

    reduced: FloatArray
    bias: FloatArray


class _Laws:
    """The laws over quantities that have breaks, as `led_laws` returns them, at poses of a plan."""

    def __init__(self, plan: SolvePlan) -> None:
        laws = led_laws(plan)
        self.counts = laws.counts
        if not self.counts:
            return
        stage = load_stage(laws.steps)
        self._stage, self._places, self._count = stage.of_sample, stage.places, len(laws.steps.results)
        given = [*(name.derivative(0) for name in plan.unknowns), *(driver.inputs[0] for driver in plan.drivers)]
        given += [law_symbol(constant.name) for constant in plan.load_constants]
        self._constants = tuple(constant.value for constant in plan.load_constants)
        self._chosen = itemgetter(*(given.index(name) for name in stage.given), 0, 0)  # two more: it returns a tuple

    def at(self, pose: Pose) -> Vector:
        numbers = [0.0] * self._count
        found = self._stage(self._chosen((*pose.z, *pose.u, *self._constants))[:-2])
        for place, value in zip(self._places, found, strict=True):
            numbers[place] = value
        return tuple(numbers)


class EquationOfMotion:
    """Accelerations of the drivers of a plan under efforts.

    Args:
        plan: A plan of `force_plan`, without parameters.
        efforts: Of the drivers, in their order, and then of external loads.

    Attributes:
        solver: Gives the poses.
        pose: The last good pose.
        failed: The last pose that could not be reached; None: all could.
        evaluations: How many accelerations were computed.

    """

    def __init__(self, plan: SolvePlan, efforts: Efforts) -> None:
        self.plan, self.efforts = plan, efforts
        self.solver = Solver(load_model(plan))
        self.pose = self.solver.anchor
        self.failed: Pose | None = None
        self.evaluations = 0
        d = len(plan.drivers)
        metre = METRES[plan.mechanism.length_unit]
        self.in_si = np.array([metre if driver.quantity.kind == "length" else 1.0 for driver in plan.drivers])
        self._rest, self._units = (0.0,) * d, [tuple(float(k == j) for j in range(d)) for k in range(d)]
        self._state_names = [name for driver in plan.drivers for name in driver.inputs[:2]]
        biases = [f"{driver.name}.bias_{effort_noun(driver.quantity.kind)}" for driver in plan.drivers]
        pairs = [(k, j) for k in range(d) for j in range(k, d)]
        reduced = [self._inertia_name(k, j) for k, j in pairs]
        known = force_names(plan.mechanism)
        stage = load_stage(force_steps(plan, [*biases, *reduced], coefficients="given"))
        order = [str(name) for name in known if name in {*biases, *reduced}]
        self._places, self._count = list(stage.places), len(order)
        self._biases = [order.index(name) for name in biases]
        self._reduced = [(k, j, order.index(name)) for (k, j), name in zip(pairs, reduced, strict=True)]
        self._stage = stage.of_sample
        self._laws = _Laws(plan)
        given = [name.derivative(n) for n in range(3) for name in plan.outputs]
        given += [derivative_name(name, k) for k in range(d) for name in plan.outputs]
        given += [driver.inputs[n] for n in range(3) for driver in plan.drivers]
        constants = (*plan.law_constants, *plan.load_constants)
        given += [*list(efforts.by_name)[d:], "time", *(law_symbol(constant.name) for constant in constants)]
        self._constants: Vector = tuple(constant.value for constant in constants)
        places = {name: place for place, name in enumerate(given)}
        self._chosen = itemgetter(*(places[name] for name in stage.given), 0, 0)  # two more: it returns a tuple

    def state(self, u: Sequence[float], ud: Sequence[float]) -> State:
        """Return values and speeds by the names of inputs."""
        return dict(zip(self._state_names, (x for pair in zip(u, ud, strict=True) for x in pair), strict=True))

    def follow(self, u: Vector) -> Pose | None:
        """Return the pose at driver values, followed from the last good one; None if they are not reached."""
        pose = self.solver.solve(self.pose, u)
        if not pose.good:
            self.failed = pose
            return None
        self.pose = pose
        return pose

    def inertia(self, t: float, pose: Pose, ud: Vector, loads: Sequence[float]) -> Inertia:
        """Return reduced inertia and bias efforts at a pose; loads: efforts of external loads."""
        solver, rest = self.solver, self._rest
        numbers: Vector = solver.motion(pose, ud, rest)
        for unit in self._units:
            numbers += tuple(solver.rates(pose, unit))
        found = self._stage(self._chosen((*numbers, *pose.u, *ud, *rest, *loads, t, *self._constants))[:-2])
        results = [0.0] * self._count
        for place, value in zip(self._places, found, strict=True):
            results[place] = value
        d = len(rest)
        reduced = np.empty((d, d))
        for k, j, place in self._reduced:
            reduced[k, j] = reduced[j, k] = results[place]
        return Inertia(reduced, np.array([results[place] for place in self._biases]))

    @property
    def law_counts(self) -> tuple[int, ...]:
        """How many breaks each law over a quantity has; empty without breaks."""
        return self._laws.counts

    def law_numbers(self, pose: Pose) -> Vector:
        """Return arguments and breaks of the laws over quantities at a pose, as `first_crossing` takes them."""
        return self._laws.at(pose)

    def accelerations(self, t: float, u: Vector, ud: Vector) -> FloatArray | None:
        """Return the accelerations of the drivers (d,), in their units; None where the pose is not reached."""
        self.evaluations += 1
        pose = self.follow(u)
        if pose is None:
            return None
        efforts = self.efforts.at(t, self.state(u, ud))
        d = len(u)
        reduced, bias = self.inertia(t, pose, ud, efforts[d:])
        if d == 1:
            inertia = float(reduced[0, 0])
            return np.array([(efforts[0] - float(bias[0])) / inertia / self.in_si[0] if inertia else np.nan])
        try:
            found: FloatArray = np.linalg.solve(reduced, np.array(efforts[:d]) - bias) / self.in_si
        except np.linalg.LinAlgError:
            return np.full(d, np.nan)
        return found

    def require_inertia(self, t: float, ud: Vector) -> None:
        """Raise a RequestError if drivers move no mass at the present pose."""
        efforts = self.efforts.at(t, self.state(self.pose.u, ud))
        reduced, _ = self.inertia(t, self.pose, ud, efforts[len(ud) :])
        names = [driver.name for driver, own in zip(self.plan.drivers, np.diag(reduced), strict=True) if not own > 0.0]
        if names:
            raise RequestError(
                f"driver {listed(names)}: its reduced inertia is 0, so that efforts do not determine its motion; "
                "give a body that it moves a mass or an inertia"
            )

    def _inertia_name(self, k: int, j: int) -> str:
        own, other = self.plan.drivers[k], self.plan.drivers[j]
        return f"{own.name}.reduced_inertia" + ("" if own is other else f".{other.name}")
