"""A case: samples of a mechanism's motion, and what is exactly true at some of them."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.system import System
from kinfmu.run.driving import run_times
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.pose import Vector
from kinfmu.units import CoordinateName

STEPS_BETWEEN = 5  # steps of a sweep from one sample of the reference to the next

Motion = Sequence[Sequence[float]]  # a sample as it comes: q, qd, qdd of all columns in one row


@dataclass(frozen=True, eq=False)
class Case:
    """n samples that are solved in their order, m columns of which are compared.

    plan: for all generalized coordinates; t: (n,) what the speeds are rates of, a time [s] or the driver itself;
    u, ud, udd: values, speeds and accelerations of the drivers, a tuple a sample; known: (k,) which samples have a
    reference; exact: (k, 3, m) q, qd, qdd there; scale: (3, m) what an error is relative to.
    """

    name: str
    plan: SolvePlan
    t: list[float]
    u: list[Vector]
    ud: list[Vector]
    udd: list[Vector]
    known: list[int]
    exact: FloatArray
    scale: FloatArray

    @property
    def mechanism(self) -> Mechanism:
        return self.plan.mechanism

    @property
    def columns(self) -> tuple[CoordinateName, ...]:
        """Names of the generalized coordinates."""
        return self.plan.outputs

    @cached_property
    def start(self) -> Pose:
        """The pose at the first sample, to round-off: where every engine starts from."""
        solver = Solver(load_model(self.plan))
        return solver.solve(solver.anchor, self.u[0])

    @cached_property
    def system(self) -> System:
        """All constraint rows, for engines that work on them."""
        return System(self.mechanism)

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """As many independent rows of the system as there are coordinates."""
        return (*find_redundancy(self.system).kept, *range(self.system.joint_row_count, len(self.system.rows)))

    @cached_property
    def start_coordinates(self) -> FloatArray:
        """All coordinates of the system at the first sample, (n,)."""
        model = load_model(self.plan)
        known = {**model.FIXED, **dict(zip(self.columns, model.outputs(self.start.values), strict=True))}
        return np.array([known[name] for name in self.system.coordinates])

    def errors(self, rows: Motion) -> FloatArray:
        """Return the largest relative error of q, qd, qdd at each known sample, (k, 3); NaN without numbers."""
        found = np.array([rows[k] for k in self.known], dtype=float).reshape(self.exact.shape)
        return np.asarray((np.abs(found - self.exact) / self.scale).max(axis=2))


def of_gallery(name: str) -> Case:
    """Return the run of a mechanism of the gallery between the first and the last sample of its reference.csv.

    The reference holds closed forms in 50 digits, written with 20; errors are relative to each column's largest
    magnitude.
    """
    plan = compile_plan(gallery.load(name))
    plan = compile_plan(plan.mechanism, plan.outputs[: plan.coordinate_count])
    with (gallery.folder() / name / "reference.csv").open(encoding="utf-8", newline="") as file:
        reference = list(csv.DictReader(file))
    exact = np.array([[[float(row[c.derivative(k)]) for c in plan.outputs] for k in range(3)] for row in reference])
    times = [float(row["time"]) for row in reference]
    grid = run_times(plan.mechanism.run).tolist()
    first, second = grid.index(times[0]), grid.index(times[1])
    between = second - first  # steps of the run
    stride = next(k for k in range(max(1, between // STEPS_BETWEEN), between + 1) if between % k == 0)
    t = grid[first : grid.index(times[-1]) + 1 : stride]
    constants = tuple(constant.value for constant in plan.law_constants)
    drive = load_model(plan).drive
    u, ud, udd = (list(column) for column in zip(*(drive(value, constants) for value in t), strict=True))
    return Case(name, plan, t, u, ud, udd, [t.index(value) for value in times], exact, _scale(plan.outputs, exact))


def along_driver(
    name: str, plan: SolvePlan, u: Sequence[float], known: Sequence[int], closed_form: Callable[[float], FloatArray]
) -> Case:
    """Return samples of the only driver's value at speed 1; closed_form: (3, m) q, q', q'' at a value of the driver.

    Errors are absolute, in radians and the mechanism's unit of length.
    """
    exact = np.array([closed_form(u[k]) for k in known])
    ones: list[Vector] = [(1.0,)] * len(u)
    none: list[Vector] = [(0.0,)] * len(u)
    scale = np.ones(exact.shape[1:])
    return Case(name, plan, list(u), [(value,) for value in u], ones, none, list(known), exact, scale)


def _scale(names: Sequence[CoordinateName], exact: FloatArray) -> FloatArray:
    """Return the largest magnitude of each column, (3, m); where it is zero all along that of its kind, else 1."""
    largest: FloatArray = np.abs(exact).max(axis=0)
    angles = np.array([name.is_angle for name in names])
    for order in range(3):
        for kind in (angles, ~angles):
            of_kind = largest[order, kind].max(initial=0.0)
            largest[order] = np.where(kind & (largest[order] == 0.0), of_kind or 1.0, largest[order])
    return largest
