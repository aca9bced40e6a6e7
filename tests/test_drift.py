"""Drift: ten thousand turns and back lose nothing but the rounding of the angles, which keep their turns."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Run
from kinfmu.solver.python import Status
from tests import oracle
from tests.mechanisms import fourbar
from tests.oracle import mp

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
