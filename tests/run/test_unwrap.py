"""Unwrapping of angles: the function, in solve and in simulate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.fmu import build, simulate
from kinfmu.run.driving import unwrap
from tests.oracle import largest_error, reference_fourbar


def test_no_step_is_more_than_half_a_turn_and_no_digit_is_lost() -> None:
    u = np.concatenate([np.linspace(0.0, 700.0, 901), np.linspace(700.0, -300.0, 777)])  # [rad]
    wrapped = np.remainder(u, 2.0 * np.pi)
    followed = unwrap(wrapped)
    np.testing.assert_allclose(followed, u, rtol=0, atol=3e-13)
    assert unwrap(followed).tolist() == followed.tolist()


def test_half_a_turn_is_unchanged_and_a_little_more_is_turned_back() -> None:
    for step in (np.pi, -np.pi, np.pi + 1e-12):
        assert unwrap(np.array([1.0, 1.0 + step]))[1] == 1.0 + step
    assert unwrap(np.radians([0.0, 181.0, 359.0, 10.0])) == pytest.approx(np.radians([0.0, -179.0, -1.0, 10.0]))
    assert unwrap(np.array([700.0])).tolist() == [700.0]
    assert len(unwrap(np.array([]))) == 0


def test_solve_unwraps_angles_only_if_asked() -> None:
    u = np.radians([300.0, 350.0, 10.0, 60.0, 350.0])
    mechanism = kinfmu.load("fourbar")
    np.testing.assert_array_equal(kinfmu.solve(mechanism, crank_angle=u)["crank.phi"], u)
    followed = kinfmu.solve(mechanism, crank_angle=u, wrap=True)
    assert followed["crank.phi"] == pytest.approx(np.radians([300.0, 350.0, 370.0, 420.0, 350.0]), abs=1e-14)
    assert followed["rocker.phi"] == pytest.approx(followed["crank.phi"], abs=1e-13)
    assert largest_error(followed.q, reference_fourbar(list(followed.inputs[:, 0])).q) <= 1e-12


def test_wrap_makes_a_difference_where_a_mechanism_does_not_repeat_each_turn() -> None:
    mechanism = kinfmu.load("geared_five_bar")
    (name,) = (name for name in kinfmu.solve(mechanism).input_names if name.endswith("_angle"))
    degrees = np.arange(0.0, 720.0, 30.0)
    going_on = kinfmu.solve(mechanism, **{name: np.radians(degrees)})
    followed = kinfmu.solve(mechanism, wrap=True, **{name: np.radians(degrees % 360.0)})
    np.testing.assert_allclose(followed.q, going_on.q, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("fourbar", {"t": [0.0]}, "wrap unwraps angles given as inputs, such as crank_angle; times by a law have no"),
        ("fourbar", {}, "wrap unwraps angles given as inputs"),
        ("parallel_jaw", {"piston_position": [1.0]}, "no input is one; inputs: piston_position, piston_speed"),
    ],
)
def test_wrap_without_angles_to_follow_is_reported(name: str, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(KinfmuError, match=message):
        kinfmu.solve(kinfmu.load(name), wrap=True, **arguments)  # type: ignore[arg-type]


def test_simulate_follows_wrapped_angles_between_the_rows_of_a_table(tmp_path: Path) -> None:
    fmu = build(kinfmu.load("fourbar"), tmp_path, drive="inputs")
    table = tmp_path / "angles.csv"
    table.write_text("time,crank_angle [deg]\n0,300\n1,350\n2,40\n", encoding="utf-8")
    run = simulate(fmu, stop=2.0, step=0.5, inputs=table, wrap=True)
    assert np.degrees(run["crank.phi"]) == pytest.approx([300.0, 325.0, 350.0, 375.0, 400.0])
    as_it_stands = simulate(fmu, stop=2.0, step=0.5, inputs=table)
    assert np.degrees(as_it_stands["crank.phi"]) == pytest.approx([300.0, 325.0, 350.0, 195.0, 40.0])
    with pytest.raises(KinfmuError, match="no inputs are given"):
        simulate(fmu, wrap=True)
    with pytest.raises(KinfmuError, match="wrap unwraps angles, and no column is one; columns: crank_speed"):
        simulate(fmu, wrap=True, inputs={"time": [0.0, 200.0], "crank_speed": [1.0, 1.0]})
