"""A case: samples of a mechanism's motion, and what is exactly true at some of them."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu import gallery
from kinfmu.backends.python import load_module
from kinfmu.mechanism import Mechanism
from kinfmu.naming import derivative_name
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.run import FloatArray
from kinfmu.solver.pose import Vector
from kinfmu.sweep import run_times

STEPS_BETWEEN = 10  # steps of a sweep from one sample of the reference to the next

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
    def columns(self) -> tuple[str, ...]:
        """Names of the generalized coordinates."""
        return self.plan.outputs

    def errors(self, rows: Motion, columns: Sequence[int] = ()) -> FloatArray:
        """(k, 3) largest relative error of q, qd, qdd at each known sample; NaN where there are no numbers.

        columns: those that were solved for; all if none are named.
        """
        chosen = list(columns) or list(range(len(self.columns)))
        found = np.array([rows[k] for k in self.known], dtype=float).reshape(len(self.known), 3, len(chosen))
        relative = np.abs(found - self.exact[:, :, chosen]) / self.scale[:, chosen]
        return np.asarray(relative.max(axis=2))


def of_gallery(name: str) -> Case:
    """The run of a mechanism of the gallery between the first and the last sample of its reference.csv.

    The reference holds closed forms in 50 digits, written with 20; errors are relative to each column's largest
    magnitude.
    """
    plan = compile_plan(gallery.load(name))
    plan = compile_plan(plan.mechanism, plan.outputs[: plan.coordinate_count])
    with (gallery.folder() / name / "reference.csv").open(encoding="utf-8", newline="") as file:
        reference = list(csv.DictReader(file))
    exact = np.array(
        [[[float(row[derivative_name(c, k)]) for c in plan.outputs] for k in range(3)] for row in reference]
    )
    times = [float(row["time"]) for row in reference]
    grid = run_times(plan.mechanism.run).tolist()
    first, second = grid.index(times[0]), grid.index(times[1])
    between = second - first  # steps of the run
    stride = next(k for k in range(max(1, between // STEPS_BETWEEN), between + 1) if between % k == 0)
    t = grid[first : grid.index(times[-1]) + 1 : stride]
    module = load_module(plan)
    constants = tuple(constant.value for constant in plan.law_constants)
    model = module.bound(tuple(value for _, value in module.PARAMETERS)) if plan.parameters else module
    u, ud, udd = (list(column) for column in zip(*(model.drive(value, constants) for value in t), strict=True))
    return Case(name, plan, t, u, ud, udd, [t.index(value) for value in times], exact, _scale(plan.outputs, exact))


def along_driver(
    name: str, plan: SolvePlan, u: Sequence[float], known: Sequence[int], closed_form: Callable[[float], FloatArray]
) -> Case:
    """Samples of the only driver's value at speed 1; closed_form: (3, m) q, q', q'' at a value of the driver.

    Errors are absolute, in radians and the mechanism's unit of length.
    """
    exact = np.array([closed_form(u[k]) for k in known])
    ones, none = [(1.0,)] * len(u), [(0.0,)] * len(u)
    scale = np.ones(exact.shape[1:])
    return Case(name, plan, list(u), [(value,) for value in u], ones, none, list(known), exact, scale)


def _scale(names: Sequence[str], exact: FloatArray) -> FloatArray:
    """(3, m) the largest magnitude of each column; where it is zero all along that of its kind, else 1."""
    largest = np.abs(exact).max(axis=0)
    angles = np.array([name.endswith(".phi") for name in names])
    for order in range(3):
        for kind in (angles, ~angles):
            of_kind = largest[order, kind].max(initial=0.0)
            largest[order] = np.where(kind & (largest[order] == 0.0), of_kind or 1.0, largest[order])
    return largest
