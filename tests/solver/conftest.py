"""Solvers of the gallery's mechanisms, and what the four-bar's outputs are by the oracle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Pose, Solver
from tests.oracle import largest_error, reference_fourbar

COORDINATES = ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]


@pytest.fixture(scope="session")
def fourbar() -> Solver:
    return Solver(load_model(compile_plan(kinfmu.load("fourbar"), COORDINATES)))


@pytest.fixture(scope="session")
def pendulum() -> Solver:
    return Solver(load_model(compile_plan(kinfmu.load("double_pendulum"))))


@pytest.fixture(scope="session")
def errors() -> Callable[[Solver, Pose], list[float]]:
    """Errors of q, qd, qdd of the four-bar at speed 1 against the oracle."""

    def measured(solver: Solver, pose: Pose) -> list[float]:
        exact = reference_fourbar(pose.u[0])
        rows = solver.outputs(pose), solver.rates(pose, (1.0,)), solver.accelerations(pose, (1.0,), (0.0,))
        return [largest_error(np.array(row), table) for row, table in zip(rows, exact, strict=True)]

    return measured
