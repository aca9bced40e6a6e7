"""Run: named columns with units, fixed coordinates, and messages of unknown names."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(kinfmu.load("fourbar"), np.arange(5.0) * 10.0)


def test_columns_come_in_the_order_of_the_contract(run: Run) -> None:
    coordinates = ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi", "A.x", "A.y"]
    rates = ["crank.omega", "coupler.vx", "coupler.vy", "coupler.omega", "rocker.omega", "A.vx", "A.vy"]
    accelerations = ["crank.alpha", "coupler.ax", "coupler.ay", "coupler.alpha", "rocker.alpha", "A.ax", "A.ay"]
    diagnostics = ["status", "residual", "iterations", "margin", "error_q", "error_qd", "error_qdd"]
    assert [column.name for column in run.columns()] == [
        "time",
        "crank_angle",
        "crank_speed",
        "crank_acceleration",
        *coordinates,
        *rates,
        *accelerations,
        *(f"solver.{name}" for name in diagnostics),
        "watch.AB.length",
    ]


def test_every_column_declares_its_unit_and_has_a_number_a_sample(run: Run) -> None:
    units = {column.name: column.unit for column in run.columns()}
    assert units["time"] == "s"
    assert [units[f"crank_{name}"] for name in ("angle", "speed", "acceleration")] == ["rad", "rad/s", "rad/s2"]
    assert [units[name] for name in ("coupler.x", "coupler.vx", "coupler.ax")] == ["m", "m/s", "m/s2"]
    assert [units[name] for name in ("rocker.phi", "rocker.omega", "rocker.alpha")] == ["rad", "rad/s", "rad/s2"]
    assert units["solver.residual"] == units["watch.AB.length"] == "1"
    assert all(column.values.shape == (5,) for column in run.columns())


def test_names_of_columns_are_all_different_and_lead_to_their_values(run: Run) -> None:
    names = [column.name for column in run.columns()]
    assert len(set(names)) == len(names)
    for column in run.columns():
        np.testing.assert_array_equal(run[column.name], column.values)


def test_q_qd_and_qdd_are_the_generalized_coordinates_without_the_points(run: Run) -> None:
    assert run.names == ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
    assert run.q.shape == run.qd.shape == run.qdd.shape == (5, 5)
    np.testing.assert_array_equal(run.q[:, 1], run["coupler.x"])
    np.testing.assert_array_equal(run.qd[:, 4], run["rocker.omega"])
    np.testing.assert_array_equal(run.qdd[:, 2], run["coupler.ay"])
    assert len(run) == 5


def test_a_point_of_interest_has_its_motion(run: Run) -> None:
    np.testing.assert_allclose(run["A.x"], run["coupler.x"] + 1.0, atol=1e-12)
    np.testing.assert_allclose(run["A.vy"], math.radians(1.0) * np.cos(run["crank.phi"]), atol=1e-12)


def test_a_fixed_coordinate_is_a_column_of_its_constant_that_stands_still(run: Run) -> None:
    assert run.fixed == {"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0}
    assert run["rocker.x"].tolist() == [1.0] * 5
    assert run["rocker.vx"].tolist() == [0.0] * 5
    assert run["rocker.ay"].tolist() == [0.0] * 5


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("Coupler.x", "coupler.x"),
        ("copler.omega", "coupler.omega"),
        ("rocker.xx", "rocker.x"),
        ("crank_angel", "crank_angle"),
        ("solver.stat", "solver.status"),
    ],
)
def test_an_unknown_name_suggests_a_known_one(run: Run, name: str, meant: str) -> None:
    with pytest.raises(KinfmuError) as caught:
        run[name]
    assert str(caught.value) == f"the run has no column '{name}'; did you mean '{meant}'?"


def test_a_name_like_no_other_is_reported_without_a_suggestion(run: Run) -> None:
    with pytest.raises(KinfmuError, match=r"^the run has no column 'temperature of the oil'$"):
        run["temperature of the oil"]


def test_samples_that_could_not_be_reached_are_gaps_with_a_status() -> None:
    run = kinfmu.solve(kinfmu.load("double_pendulum"), [0.0, 1.0, 2.5, 3.0, 1.0])
    assert run.status.tolist() == [0, 0, kinfmu.Status.OUTSIDE, kinfmu.Status.OUTSIDE, 0]
    assert run.good.tolist() == [True, True, False, False, True]
    assert np.isnan(run.q[2:4]).all()
    assert np.isfinite(run.q[run.good]).all()
    np.testing.assert_allclose(run.q[4], run.q[1], atol=1e-12)
    (event,) = run.events
    assert (event.t, event.level) == (2.5, "error")
    assert "crank" in event.text


def test_a_run_keeps_the_mechanism_it_is_of(run: Run) -> None:
    assert run.mechanism == kinfmu.load("fourbar")
    assert parse(run.mechanism_text) == run.mechanism
    assert run.info["name"] == "fourbar"
    assert run.length_unit == "m"
