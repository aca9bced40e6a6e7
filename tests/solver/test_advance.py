"""Advance: the branch is kept, limits are found, every way ends."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import numpy as np
import pytest

import kinfmu
from kinfmu.solver import Pose, Solver, Status
from tests.mechanisms import slider_crank

Errors = Callable[[Solver, Pose], list[float]]


@pytest.mark.parametrize("seed", range(12))
def test_branch_is_kept_over_random_grids_there_and_back(fourbar: Solver, errors: Errors, seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311  # a grid, not a secret
    pose, u, h = fourbar.anchor, 0.5, 10.0 ** rng.uniform(-1.0, 0.7)
    places: list[float] = []
    while abs(u) < 15.0 and len(places) < 60:
        places.append(u)
        u += rng.uniform(0.5, 1.5) * h
    for u in (*places, *reversed(places)):
        pose = fourbar.solve(pose, (u,))
        assert pose.good
        q, qd, qdd = errors(fourbar, pose)
        assert (q < 1e-13, qd < 1e-11, qdd < 1e-9) == (True, True, True)


@pytest.mark.parametrize(("target", "limit"), [(7.0, 2.0 * math.pi), (3.0, math.pi)])
def test_limit_is_located_and_named_and_the_way_back_is_open(pendulum: Solver, target: float, limit: float) -> None:
    beyond = pendulum.solve(pendulum.anchor, (target,))
    assert beyond.status == Status.OUTSIDE
    assert not beyond.good
    assert "cannot be reached: the limit is" in beyond.message
    told = float(beyond.message.split("the limit is ")[1].split(" = ")[1].split()[0])
    assert told == pytest.approx(limit, abs=1e-10)
    back = pendulum.solve(pendulum.anchor, (5.0,))
    assert back.good
    assert back.z == pytest.approx((2.0 * math.pi + math.asin(-1.0 - math.sin(5.0)),), abs=1e-13)


def test_what_is_too_far_is_told_at_once(fourbar: Solver) -> None:
    pose = fourbar.solve(fourbar.anchor, (1e300,))
    assert pose.status == Status.OUTSIDE
    assert "is too far from" in pose.message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_driver_value_that_is_no_number_is_outside(fourbar: Solver, value: float) -> None:
    assert fourbar.solve(fourbar.anchor, (value,)).status == Status.OUTSIDE


def test_same_value_is_the_same_pose(fourbar: Solver) -> None:
    pose = fourbar.solve(fourbar.anchor, (2.0,))
    assert fourbar.solve(pose, (2.0,)) is pose


def test_result_is_a_function_of_the_start_pose_alone(fourbar: Solver) -> None:
    start = fourbar.solve(fourbar.anchor, (2.5,))
    first = fourbar.solve(start, (9.0,))
    for trial in (3.2, 40.0, -7.0):
        fourbar.solve(start, (trial,))
    assert fourbar.solve(start, (9.0,)).z == first.z


def test_from_a_pose_at_the_limit_nothing_beyond_it_is_reached_and_all_before_it_is(pendulum: Solver) -> None:
    pose = pendulum.anchor
    for k in range(1, 5):
        pose = pendulum.solve(pose, (math.radians(300.0 + 15.0 * k),))
    assert pose.status == Status.NEAR_SINGULAR
    beyond = pendulum.solve(pose, (math.radians(375.0),))
    assert beyond.status == Status.OUTSIDE
    assert "the limit is" in beyond.message


def test_a_crossing_that_no_bridge_spans_is_a_limit_and_no_way_to_the_other_branch() -> None:
    """The gripper's parallelograms cross their other branch 3 mm before their dead centre: no room for a bridge."""
    piston = np.arange(-44.0, 54.6, 0.25)
    run = kinfmu.solve(kinfmu.load("parallel_jaw"), piston_position=piston)
    assert run.good[piston < 51.2].all()
    np.testing.assert_allclose(run["right_jaw.phi"][run.good], 0.0, rtol=0, atol=1e-9)
    assert (run.status[piston > 51.25] == Status.OUTSIDE).all()
    assert any("the limit is piston = 51.22498" in event.text for event in run.events)


def test_prediction_far_off_does_not_land_a_turn_away() -> None:
    # beside a limit the rod turns ever faster than the crank: one long step back once took it round
    mechanism = slider_crank(1.78, 1.086, -0.796, start=0.11)
    run = kinfmu.solve(mechanism, crank_angle=[0.15220722892189027, -3.2256017379760742])
    steps = kinfmu.solve(mechanism, crank_angle=np.linspace(0.15220722892189027, -3.2256017379760742, 1000))
    assert run.good.all()
    assert steps.good.all()
    assert run["rod.phi"][1] == pytest.approx(steps["rod.phi"][-1], abs=1e-12)
