"""The two reference problems, by every number that was printed of them and against 50 digits."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu import Status
from tests.mechanisms import bar_as_body, reference_fourbar
from tests.oracle import guided_double_pendulum, largest_error
from tests.oracle import reference_fourbar as exact_fourbar

W = np.pi / 180.0
FOURBAR = ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
PRINTED = {  # t: phi1, x2, y2, phi2, phi3
    30: (0.5236, 1.8660, 0.5000, 0.0, 0.5236),
    60: (1.0472, 1.5000, 0.8660, 0.0, 1.0472),
    90: (1.5708, 1.0000, 1.0000, 0.0, 1.5708),
    120: (2.0944, 0.5000, 0.8660, 0.0, 2.0944),
    150: (2.6180, 0.1340, 0.5000, 0.0, 2.6180),
}
TEXTBOOK = (  # x1, y1, phi1, x2, y2, phi2 at t = 0
    (0.5000, -0.8660, 5.2360, 1.4910, -1.0000, 6.1488),
    (0.4534, 0.2618, 0.5236, 0.4180, 0.0, -0.2642),
    (-0.1371, 0.2374, 0.0, -0.2397, 0.0, -0.2490),
)


def test_fourbar_has_the_reports_coordinates_and_constants() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [60.0])
    assert run.names == FOURBAR
    assert run.fixed == {"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0}


def test_fourbar_gives_the_25_printed_numbers() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), list(PRINTED))
    np.testing.assert_allclose(run.q, list(PRINTED.values()), rtol=0, atol=0.5e-4)


def test_fourbar_equals_the_closed_form_from_0_to_180_inclusive() -> None:
    t = np.arange(181.0)
    run = kinfmu.solve(kinfmu.load("fourbar"), t)
    exact = exact_fourbar(list(W * t), W)
    for ours, theirs in zip((run.q, run.qd, run.qdd), exact, strict=True):
        assert largest_error(ours, theirs) <= 1e-12
    assert run.status[0] == run.status[-1] == Status.BRIDGED
    assert (run.status[10:171] == Status.OK).all()
    assert run.watch.max() < 1e-12


@pytest.mark.parametrize("rate", [W, 1.0])
def test_fourbar_stays_a_parallelogram_through_turns_both_ways(rate: float) -> None:
    degrees = np.concatenate([np.arange(0.0, 361.0), np.arange(360.0, -721.0, -7.0), np.arange(-720.0, 1100.0, 113.0)])
    u = W * degrees
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=u, crank_speed=rate)
    exact = exact_fourbar(list(u), rate)
    assert run.good.all()
    assert largest_error(run.q, exact.q) <= 1e-12
    assert largest_error(run.qd, exact.qd) <= 1e-10
    assert largest_error(run.qdd, exact.qdd) <= 1e-8


@pytest.mark.parametrize("centre", [0.0, np.pi, -np.pi, 2 * np.pi])
def test_fourbar_is_right_at_and_close_to_its_singular_points(centre: float) -> None:
    angles = [centre] + [centre + side * 10.0**-k for k in range(1, 13) for side in (1.0, -1.0)]
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=angles)
    exact = exact_fourbar(angles)
    assert largest_error(run.q, exact.q) <= 1e-12
    assert largest_error(run.qd, exact.qd) <= 1e-10
    assert largest_error(run.qdd, exact.qdd) <= 1e-8


@pytest.mark.parametrize("degrees", [0.0, 180.0])
def test_fourbar_may_start_at_a_singular_point_for_the_watch_row_decides(degrees: float) -> None:
    run = kinfmu.solve(reference_fourbar(start_degrees=degrees), crank_angle=[0.3, 2.0, 4.0])
    assert largest_error(run.q, exact_fourbar([0.3, 2.0, 4.0]).q, modulo_turns=True) <= 1e-12


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0])
def test_bar_as_a_body_moves_the_same_whichever_way_the_ground_is_turned(turn: float) -> None:
    turned = np.radians(turn)
    u = W * np.arange(0.0, 361.0, 3.0)
    run = kinfmu.solve(bar_as_body(turned), crank_angle=u + turned)
    exact = exact_fourbar(list(u)).rounded()
    c, s = np.cos(turned), np.sin(turned)
    for ours, theirs, offset, allowed in (
        ((run["coupler.x"], run["coupler.y"], run["coupler.phi"], run["rocker.phi"]), exact.q, turned, 1e-12),
        ((run["coupler.vx"], run["coupler.vy"], run["coupler.omega"], run["rocker.omega"]), exact.qd, 0.0, 1e-10),
        ((run["coupler.ax"], run["coupler.ay"], run["coupler.alpha"], run["rocker.alpha"]), exact.qdd, 0.0, 1e-8),
    ):
        x, y, phi2, phi3 = theirs[:, 1], theirs[:, 2], theirs[:, 3], theirs[:, 4]
        for value, expected in zip(ours, (c * x - s * y, s * x + c * y, phi2 + offset, phi3 + offset), strict=True):
            np.testing.assert_allclose(value, expected, rtol=0, atol=allowed)
    np.testing.assert_allclose(run["bar.phi"], u + turned, rtol=0, atol=1e-12)
    assert run.good.all()


def test_pendulum_gives_the_textbooks_18_numbers() -> None:
    run = kinfmu.solve(kinfmu.load("double_pendulum"), [0.0])
    np.testing.assert_allclose([run.q[0], run.qd[0], run.qdd[0]], TEXTBOOK, rtol=0, atol=1e-4)


def test_pendulum_equals_50_digits_over_its_run() -> None:
    t = np.linspace(0.0, 1.5, 151)
    mechanism = kinfmu.load("double_pendulum")
    run = kinfmu.solve(mechanism, t)
    exact = guided_double_pendulum(list(run.inputs[:, 0]), mechanism.drivers[0].law.speed)
    for ours, theirs in zip((run.q, run.qd, run.qdd), exact, strict=True):
        assert largest_error(ours, theirs) <= 1e-12


def test_pendulum_beyond_its_limits_is_outside_and_comes_back_on_its_branch() -> None:
    u = [5.0, 6.2, 6.4, 7.0, 6.2, 5.0, 3.2, 3.0, 3.2]
    run = kinfmu.solve(kinfmu.load("double_pendulum"), crank_angle=u)
    assert run.status.tolist() == [0, 0, 3, 3, 0, 0, 0, 3, 0]
    good = [u[k] for k in np.flatnonzero(run.good)]
    assert largest_error(run.q[run.good], guided_double_pendulum(good).q) <= 1e-12
    assert np.isnan(run.q[~run.good]).all()
    assert "crank = 6.4 rad" in run.events[0].text
    assert "360 deg" in run.events[0].text
    assert "180 deg" in run.events[1].text
