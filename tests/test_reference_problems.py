"""The two reference problems, and drift over many turns."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Run, Status
from tests import oracle
from tests.mechanisms import bar_as_body, fourbar, reference_fourbar
from tests.oracle import guided_double_pendulum, largest_error, mp
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


# ---------------------------------------------------------------------------------------------------------------- drift


TURN = 2.0 * math.pi
DOUBLE_CRANK = (1.0, 2.5, 2.1, 2.3)  # ground, crank, coupler, rocker: every moving link turns with the crank
CRANK_ROCKER = (4.0, 1.0, 3.5, 3.0)  # coupler and rocker swing
EPS = 2.0**-52


def linkage(bars: tuple[float, ...]) -> Mechanism:
    return fourbar(*bars, start=1.0)


def off(run: Run, bars: tuple[float, ...]) -> np.ndarray:
    """Errors of coupler.phi and rocker.phi, of their rates and accelerations, each (n,): turns count."""
    exact = oracle.fourbar(*map(repr, bars), run["crank_angle"].tolist())
    start = oracle.fourbar(*map(repr, bars), 1.0)
    columns = []
    for k, name in enumerate(("coupler", "rocker"), start=1):
        turning = bars == DOUBLE_CRANK
        gaps = []
        for ours, u, value in zip(run[f"{name}.phi"], run["crank_angle"], exact.q[:, k], strict=True):
            expected = start.q[0, k] + (mp.mpf(float(u)) - 1) * turning  # on the whole it goes where the crank goes
            value += 2 * mp.pi * mp.nint((expected - value) / (2 * mp.pi))
            gaps.append(float(abs(mp.mpf(float(ours)) - value)))
        columns.append(gaps)
        for order, quantity in ((1, "omega"), (2, "alpha")):
            pairs = zip(run[f"{name}.{quantity}"], exact[order][:, k], strict=True)
            columns.append([float(abs(mp.mpf(float(ours)) - value)) for ours, value in pairs])
    return np.array(columns)  # (6, n)


@pytest.mark.parametrize(
    ("bars", "turns"), [pytest.param(DOUBLE_CRANK, 10_000, marks=pytest.mark.long), (CRANK_ROCKER, 1_000)]
)
def test_turns_there_and_back_by_jumps_are_exact_to_the_rounding_of_the_angle(
    bars: tuple[float, ...], turns: int
) -> None:
    angles = [1.0, 2.0 + turns * TURN, 1.0, 0.5 - 3 * TURN, 1.0]
    run = kinfmu.solve(linkage(bars), crank_angle=angles)
    assert (run.status == Status.OK).all()
    errors = off(run, bars)
    largest = np.maximum(np.abs(run["rocker.phi"]), np.abs(run["crank_angle"]))
    assert (errors <= 16.0 * EPS * np.maximum(largest, 1.0)).all()
    assert (errors.max(axis=0) <= run.error.max(axis=1)).all()
    np.testing.assert_allclose(errors[:, [2, 4]], errors[:, [0, 0]], rtol=0, atol=4.0 * EPS)  # back where it was


@pytest.mark.parametrize("bars", [pytest.param(DOUBLE_CRANK, marks=pytest.mark.long), CRANK_ROCKER])
def test_walked_sample_by_sample_errors_do_not_grow(bars: tuple[float, ...]) -> None:
    there = 1.0 + np.arange(0.0, 1000.0, 0.097) * TURN
    run = kinfmu.solve(linkage(bars), crank_angle=np.concatenate([there, there[::-1]]))
    assert (run.status == Status.OK).all()
    n = len(there)
    for column in ("coupler.phi", "rocker.phi", "rocker.omega", "rocker.alpha"):
        outward, back = run[column][:n], run[column][n:][::-1]
        np.testing.assert_allclose(back, outward, rtol=0, atol=16.0 * EPS * max(1.0, np.abs(outward).max()))
    some = kinfmu.solve(linkage(bars), crank_angle=there[[0, n // 2, n - 1]])  # jumped to
    np.testing.assert_allclose(
        run["rocker.phi"][[0, n // 2, n - 1]], some["rocker.phi"], rtol=0, atol=4.0 * EPS * 1000.0 * TURN
    )
    assert (off(some, bars) <= 16.0 * EPS * 1000.0 * TURN).all()


def test_bridges_turns_away_are_those_of_the_first_turn() -> None:
    near = np.array([math.pi - 0.3, math.pi - 1e-3, math.pi, math.pi + 1e-6, math.pi + 0.02, TURN])
    angles = np.concatenate([near, near + 1000 * TURN, near[::-1]])
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=angles)
    assert run.good.all()
    assert run.status.tolist().count(Status.BRIDGED) == 15
    np.testing.assert_allclose(run["rocker.phi"], angles, rtol=0, atol=4.0 * EPS * 1000.0 * TURN)
    np.testing.assert_allclose(run["coupler.phi"], 0.0, rtol=0, atol=8.0 * EPS * 1000.0 * TURN)
    np.testing.assert_allclose(run["rocker.omega"], 1.0, rtol=0, atol=1e-9)
    first = slice(0, len(near))
    np.testing.assert_allclose(run["rocker.phi"][-len(near) :][::-1], run["rocker.phi"][first], rtol=0, atol=1e-14)


def test_an_fmu_turned_a_hundred_times_and_back_is_where_it_was(tmp_path: Path) -> None:
    table = tmp_path / "turns.csv"
    table.write_text("time,crank_angle\n0,1.0\n100,629.3185307179587\n200,1.0\n", encoding="utf-8")
    fmu = kinfmu.build(linkage(DOUBLE_CRANK), tmp_path / "turns.fmu", drive="inputs")
    run = kinfmu.simulate(fmu, stop=200.0, step=0.25, inputs=table)
    assert run.good.all()
    errors = off(run, DOUBLE_CRANK)[[0, 3]]  # the angles; rates are estimated
    assert (errors <= 8.0 * EPS * 100.0 * TURN).all()
    assert errors[:, -1].max() <= 8.0 * EPS
