"""Time a sample: the readable reference and the Python engine on the four-bar, with the error of both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import process_time

import numpy as np

from benchmarks.rounds import in_turn, spread, table
from benchmarks.singular_points import FOURBAR
from kinfmu.arrays import FloatArray
from kinfmu.cli.demo import parallelogram
from kinfmu.codegen.python import load_model
from kinfmu.mechanism.gallery import load
from kinfmu.plan import compile_plan
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.reference import solve_reference
from kinfmu.plan.equations.system import System
from kinfmu.run.solve import solve
from kinfmu.solver.python import Solver

ROUNDS = 9
DEGREES = np.arange(5.0, 176.0)  # away from the singular points, where the readable reference has no answer


def run(rounds: int = ROUNDS) -> str:
    """Return a table: microseconds a sample (median and spread over rounds) and largest error of q, qd, qdd."""
    u = np.radians(DEGREES)
    ways = {
        "readable reference, 9 coordinates, warm start": _reference(u),
        "python engine, ready: q, qd, qdd": _engine(u),
        "kinfmu.solve, the mechanism solved before": _solve(u),
        "the same, error estimates and margin read": _solve(u, read=True),
    }
    base, *_ = times = [
        spread([value / len(u) * 1e6 for value in seconds])
        for seconds in in_turn(list(ways.values()), rounds, process_time)
    ]
    rows = [
        [name, *of.cells(2), f"{base.median / of.median:.1f}", f"{_error(way(), u):.1e}"]
        for (name, way), of in zip(ways.items(), times, strict=True)
    ]
    title = f"four-bar, {len(u)} samples of 1 degree, {rounds} rounds; processor time a sample [us], absolute errors"
    return "\n".join([title, *table(("", "median", "min", "max", "times faster", "largest error"), rows)])


Results = tuple[FloatArray, FloatArray, FloatArray]


def _reference(u: FloatArray) -> Callable[[], Results]:
    system = System(load("fourbar"))
    kept = [*find_redundancy(system).kept, system.joint_row_count]
    five = [system.coordinates.index(name) for name in FOURBAR]
    q0 = np.array([0, 0, u[0], 1 + np.cos(u[0]), np.sin(u[0]), 0, 1, 0, u[0]])

    def way() -> Results:
        q, rows = q0, []
        one, none = np.ones(1), np.zeros(1)
        for value in u:
            solution = solve_reference(system, kept, q, np.array([value]), one, none)
            q = solution.q
            rows.append((solution.q[five], solution.qd[five], solution.qdd[five]))
        return _stacked(rows)

    return way


def _engine(u: FloatArray) -> Callable[[], Results]:
    mechanism = load("fourbar")
    solver = Solver(load_model(compile_plan(mechanism, FOURBAR)))

    def way() -> Results:
        pose, rows = solver.anchor, []
        for value in u.tolist():
            pose = solver.solve(pose, (value,))
            rows.append((solver.outputs(pose), solver.rates(pose, (1.0,)), solver.accelerations(pose, (1.0,), (0.0,))))
        return _stacked(rows)

    return way


def _solve(u: FloatArray, *, read: bool = False) -> Callable[[], Results]:
    plan = compile_plan(load("fourbar"))

    def way() -> Results:
        result = solve(plan, crank_angle=u)
        if read:
            _ = result.error, result.margin  # computed now
        return result.q, result.qd, result.qdd

    return way


def _stacked(rows: Sequence[tuple[object, ...]]) -> Results:
    q, qd, qdd = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    return q, qd, qdd


def _error(results: Results, u: FloatArray) -> float:
    """Return the largest difference from the closed form in q, qd and qdd at a crank speed of 1 rad/s."""
    return max(float(np.abs(ours - exact).max()) for ours, exact in zip(results, parallelogram(u), strict=True))
