"""The solver in C finds what the one in Python finds: the same bits, decisions and messages.

So that even the last bits can be compared, the Python side forms a tangent as velocity and acceleration per unit of the
driver, which the generated Python otherwise simplifies.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, gallery
from kinfmu.backends.python import load_model, load_module
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.solver import Solver, Status, with_parameters
from kinfmu.solver.pose import ALONE, AT_REST
from kinfmu.sweep import run_times
from tests.backends.native import STRICT, Native, Told
from tests.fmu.test_parameters import linkage
from tests.mechanisms import bar_as_body, fourbar, reference_fourbar, slider_crank, tight_jaw

QUICK = (*STRICT, "-O0")  # to compile
Samples = Sequence[tuple[float, ...]]


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KINFMU_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def solver_of(plan: SolvePlan) -> Solver:
    """A solver in Python whose tangents are formed as in C."""
    model = load_model(plan)
    velocity, acceleration, motion = model.velocity, model.acceleration, model.motion

    def tangent(values: Any) -> Any:
        zd = velocity(values, ALONE)
        return zd, acceleration(values, ALONE, AT_REST, zd)

    def first_motion(values: Any, ud: Any, udd: Any) -> Any:
        return tangent(values), motion(values, ud, udd, *tangent(values))

    if len(model.DRIVERS) == 1:
        model.tangent, model.first_motion = tangent, first_motion
    return Solver(model)


def assert_same(plan: SolvePlan, samples: Samples, flags: Sequence[str] = QUICK) -> list[int]:
    """Both solvers followed through the samples; the statuses met."""
    python, c = solver_of(plan), Native(plan, flags)
    good, statuses = python.anchor, []
    for u in samples:
        pose, told = python.solve(good, u), c.solve(u)
        statuses.append(told.status)
        assert told.status == pose.status, u
        if not pose.good:
            assert c.message == pose.message
            continue
        assert (told.z, told.iterations) == (pose.z, pose.iterations), u
        assert (told.margin, told.residual, told.watch) == (pose.margin, pose.residual, pose.watch), u
        ud, udd = (0.7,) * len(u), (-0.3,) * len(u)
        row, wanted = (
            [value for row in c.motion(ud, udd) for value in row or ()],
            np.array(python.motion(pose, ud, udd)),
        )
        np.testing.assert_allclose(row, wanted, rtol=0, atol=1e-12 * max(np.abs(wanted).max(), 1.0))
        assert c.margin() == pytest.approx(python.margin(pose), rel=1e-12, abs=1e-15)
        good = pose
        c.commit()
    return statuses


@pytest.mark.parametrize("name", gallery.names())
def test_c_and_python_are_the_same_over_the_run_of_a_gallery_mechanism(name: str) -> None:
    mechanism = kinfmu.load(name)
    plan = compile_plan(mechanism)
    model = load_model(plan)
    constants = tuple(value for _, value in model.LAW_CONSTANTS)
    times = run_times(mechanism.run)
    assert_same(plan, [tuple(model.drive(t, constants)[0]) for t in times[:: max(1, len(times) // 60)].tolist()])


def wander(middle: float, reach: float, special: Sequence[float], seed: int) -> Samples:
    """Short steps and jumps, back and forth, on and beside special places."""
    rng = random.Random(seed)  # noqa: S311  # samples, not secrets
    samples, u = [], middle
    for _ in range(200):
        kind = rng.random()
        if kind < 0.6:
            u += rng.uniform(-0.02, 0.05) * reach * rng.choice((1.0, 1.0, 1.0, -3.0))
        elif kind < 0.8:
            u = rng.choice(special) + rng.choice((0.0, 0.0, 1e-12, -1e-9, 1e-6, -1e-3, 0.02, -0.04)) * reach
        else:
            u = middle + rng.uniform(-4.0, 4.0) * reach
        samples.append((u,))
    return samples


QUARTERS = [k * math.pi / 2.0 for k in range(-8, 9)]
SINGULAR: dict[str, tuple[Callable[[], Mechanism], Samples, set[Status]]] = {
    "parallelogram with a redundant bar": (
        reference_fourbar, wander(1.0, 3.0, QUARTERS, 1), {Status.OK, Status.BRIDGED}),
    "bar as a body": (bar_as_body, wander(1.0, 3.0, QUARTERS, 2), {Status.OK, Status.BRIDGED}),
    "4-1-3-2": (lambda: fourbar(4, 1, 3, 2), wander(1.0, 3.0, QUARTERS, 3), {Status.OK, Status.BRIDGED}),
    "2-1-2-1": (lambda: fourbar(2, 1, 2, 1), wander(1.0, 3.0, QUARTERS, 4), {Status.OK, Status.BRIDGED}),
    "antiparallelogram": (
        lambda: fourbar(2, 1, 2, 1, branch=-1), wander(1.0, 3.0, QUARTERS, 5), {Status.OK, Status.BRIDGED}),
    "beside a change point": (
        lambda: fourbar(4, 1, 3, 2 + 1e-7), wander(1.0, 3.0, QUARTERS, 6), {Status.OK}),
    "slider-crank, crank = rod": (lambda: slider_crank(1.0, 1.0), wander(1.0, 3.0, QUARTERS, 7), {Status.OK}),
    "triple rocker": (
        lambda: kinfmu.load("triple_rocker"), wander(0.0, 0.8, [math.acos(1 / 13), -math.acos(1 / 13)], 8),
        {Status.OK, Status.OUTSIDE}),
    "double pendulum": (
        lambda: kinfmu.load("double_pendulum"), wander(5.0, 1.0, [math.pi, 2 * math.pi], 9), {Status.OK, Status.OUTSIDE}),
    "gripper": (lambda: kinfmu.load("parallel_jaw"), wander(30.0, 15.0, [51.22498, 54.5], 10), {Status.OK}),
    "tight gripper": (tight_jaw, wander(30.0, 15.0, [54.28, 54.2863], 11), {Status.OK}),
}  # fmt: skip


@pytest.mark.parametrize("name", SINGULAR)
def test_c_and_python_are_the_same_about_singular_points_and_limits(name: str) -> None:
    mechanism, samples, expected = SINGULAR[name]
    statuses = assert_same(compile_plan(mechanism()), samples)
    assert expected <= set(statuses)
