"""Runs: coarse ones, their channels and tables, and angles that count turns."""

from __future__ import annotations

import dataclasses
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import KinfmuError, MissingPackageError, RequestError
from kinfmu.fmu import build, simulate
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from kinfmu.run.channels import absent_columns, coordinates, is_drawn, kept_samples, select
from kinfmu.run.driving import unwrap
from kinfmu.run.verdict import coarse_samples
from kinfmu.units import InputName
from tests.log.runs import fourbar, with_gap
from tests.oracle import largest_error, reference_fourbar


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(kinfmu.load("fourbar"), np.arange(5.0) * 10.0)


INPUTS = ("angle", "speed", "acceleration")


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


@pytest.mark.parametrize("moved", ["left", "right", "both"])
def test_columns_of_a_run_over_driver_values_begin_with_the_driver_and_have_no_time(moved: str) -> None:
    angles = {f"{name}_angle": 1.0 + (moved in (name, "both")) * np.linspace(0.0, 0.1, 3) for name in ("left", "right")}
    run = kinfmu.solve(kinfmu.load("five_bar"), **angles)
    names = [column.name for column in run.columns()]
    others = {"left": "right", "right": "left", "both": "right"}
    first = moved if moved != "both" else "left"
    assert names[0] == f"{first}_angle"
    assert set(names[:6]) == {f"{name}_{kind}" for name in (first, others[moved]) for kind in INPUTS}
    assert "time" not in names
    assert len(set(names)) == len(names)


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


# --------------------------------------------------------------------------------------------------------------- coarse


CRANK, SLIDE = InputName("crank", "angle"), InputName("slide", "position")
Motion = Callable[[Any], tuple[Any, Any]]  # t -> value, speed
MOTIONS: dict[str, tuple[InputName, Motion]] = {
    "turns": (CRANK, lambda t: (20.0 * t, 20.0 + 0.0 * t)),
    "swings": (CRANK, lambda t: (0.3 * np.sin(20.0 * t + 0.4), 6.0 * np.cos(20.0 * t + 0.4))),
    "slides to and fro": (SLIDE, lambda t: (80.0 * np.sin(20.0 * t), 1600.0 * np.cos(20.0 * t))),
    "settles": (SLIDE, lambda t: (1.0 - np.exp(-50.0 * t), 50.0 * np.exp(-50.0 * t))),
}


def note_of(name: InputName, motion: Motion, step: float, stop: float = 3.0) -> str:
    t = step * np.arange(round(stop / step) + 1)
    u, ud = motion(t)
    return coarse_samples(t, [name], u[:, None], ud[:, None])


@pytest.mark.parametrize("which", MOTIONS)
@pytest.mark.parametrize("step", [0.1, 0.15, np.pi / 10.0])
def test_coarse_samples_are_noted_with_a_step_that_would_do(which: str, step: float) -> None:
    name, motion = MOTIONS[which]
    text = note_of(name, motion, step)
    found = re.fullmatch(
        rf"samples {step:.6g} s apart do not show the motion: .*{name.driver}.*; a step of (\S+) s would", text
    )
    assert found, text
    assert not note_of(name, motion, float(found[1]))
    assert float(found[1]) >= 0.001  # not finer than needed: the period is 0.3 s


@pytest.mark.parametrize("motion", [lambda t: (0.5 * 3.0 * t * t, 3.0 * t), lambda t: (0.0 * t + 7.0, 0.0 * t)])
def test_few_samples_of_a_plain_motion_are_no_matter(motion: Motion) -> None:
    assert not note_of(CRANK, motion, 0.25, 0.5)
    assert not note_of(SLIDE, motion, 0.25, 0.5)


def test_a_sample_without_numbers_and_fewer_than_three_samples_are_no_matter() -> None:
    t = np.array([0.0, 0.1, 0.2])
    u = np.array([[0.0], [0.1], [np.nan]])
    assert not coarse_samples(t, [CRANK], u, np.ones((3, 1)))
    assert not coarse_samples(t[:2], [CRANK], 50.0 * u[:2], 500.0 * np.ones((2, 1)))


def test_the_note_states_the_angle() -> None:
    assert note_of(*MOTIONS["turns"], 0.1) == (
        "samples 0.1 s apart do not show the motion: crank turns by up to 115 deg from one to the next; "
        "a step of 0.005 s would"
    )


# --------------------------------------------------------------------------------------------------------------- tables


RUN = with_gap(fourbar(np.arange(20.0)), 5, 7)
UNITS = {place.name: place.unit for place in RUN.places()}


def assert_columns_are(run: Run, table: dict[str, np.ndarray]) -> None:
    assert list(table) == [column.name for column in run.columns()]
    for column in run.columns():
        assert table[column.name].dtype == column.values.dtype, column.name
        assert table[column.name].tobytes() == np.ascontiguousarray(column.values).tobytes(), column.name


def test_arrow_holds_the_units() -> None:
    pytest.importorskip("pyarrow")
    table = RUN.to_arrow()
    assert_columns_are(RUN, {name: table[name].to_numpy() for name in table.column_names})
    assert {field.name: field.metadata[b"unit"].decode() for field in table.schema} == UNITS


def test_pandas_holds_the_units_too() -> None:
    pytest.importorskip("pandas")
    frame = RUN.to_pandas()
    assert_columns_are(RUN, {name: frame[name].to_numpy() for name in frame.columns})
    assert frame.attrs["units"] == UNITS


def test_polars_is_one_call_away() -> None:
    pytest.importorskip("polars")
    frame = RUN.to_polars()
    assert_columns_are(RUN, {name: frame[name].to_numpy() for name in frame.columns})


def test_columns_that_were_not_kept_are_not_in_a_table() -> None:
    pytest.importorskip("pyarrow")
    part = RUN.without({"coupler.x", "solver.margin"})
    assert_columns_are(part, {name: part.to_arrow()[name].to_numpy() for name in part.to_arrow().column_names})
    assert "coupler.x" not in part.to_arrow().column_names


@pytest.mark.parametrize("package", ["pyarrow", "pandas", "polars"])
def test_a_package_that_is_missing_is_named(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    call = {"pyarrow": RUN.to_arrow, "pandas": RUN.to_pandas, "polars": RUN.to_polars}[package]
    with pytest.raises(MissingPackageError, match=f"^a table of {package} needs this package: pip install {package}$"):
        call()


# --------------------------------------------------------------------------------------------------------------- unwrap


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


# ------------------------------------------------------------------------------------------------------------- channels


def whole_run(n: int = 5) -> Run:
    return fourbar(np.arange(float(n)))


def kept(*names: str) -> list[str]:
    return [column.name for column in select(whole_run(), names).columns()]


def never() -> NoReturn:
    raise AssertionError("this was not to be computed")


def test_groups_are_the_columns_that_they_say() -> None:
    assert kept("none") == ["time", "solver.status"]
    assert kept("inputs") == ["time", "crank_angle", "crank_speed", "crank_acceleration", "solver.status"]
    q = ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
    assert kept("q") == ["time", *q, "solver.status"]
    assert kept("qd")[1:6] == ["crank.omega", "coupler.vx", "coupler.vy", "coupler.omega", "rocker.omega"]
    assert kept("qdd")[1:6] == ["crank.alpha", "coupler.ax", "coupler.ay", "coupler.alpha", "rocker.alpha"]
    assert kept("points")[1:-1] == ["A.x", "A.y", "A.vx", "A.vy", "A.ax", "A.ay"]
    assert kept("error")[2:] == ["solver.error_q", "solver.error_qd", "solver.error_qdd"]
    assert kept("residual", "iterations", "margin", "watch")[2:] == [
        "solver.residual",
        "solver.iterations",
        "solver.margin",
        "watch.AB",
    ]


def test_all_means_every_column_as_does_no_choice() -> None:
    everything = [column.name for column in whole_run().columns()]
    assert kept("all") == everything == [column.name for column in select(whole_run()).columns()]


def test_columns_are_chosen_by_name_and_by_pattern_and_left_out_by_a_minus() -> None:
    assert kept("coupler.vx", "rocker.*") == [
        "time", "rocker.phi", "coupler.vx", "rocker.omega", "rocker.alpha", "solver.status",
    ]  # fmt: skip
    everything = kept("all")
    assert kept("-error", "-A.?") == [name for name in everything if "error" not in name and name not in ("A.x", "A.y")]
    assert kept("q", "-coupler.*") == ["time", "crank.phi", "rocker.phi", "solver.status"]


def test_what_is_drawn_is_chosen_like_a_channel() -> None:
    assert [is_drawn(names) for names in (None, ["all"], ["-error"], ["q", "drawn"])] == [True] * 4
    assert [is_drawn(names) for names in (["none"], ["q"], ["-drawn"], ["all", "-drawn"])] == [False] * 4


def test_an_unknown_channel_is_reported_with_similar_names() -> None:
    with pytest.raises(
        KinfmuError, match=r"^channel 'margins' is not known; did you mean 'margin'\?; channels: all, none"
    ):
        absent_columns(whole_run(), ["margins"])
    with pytest.raises(KinfmuError, match=r"did you mean 'coupler\.vx'\?; .*, or columns such as 'crank\.phi', with"):
        absent_columns(whole_run(), ["coupler.vxx"])


def test_coordinates_are_chosen_as_columns_are_in_the_order_named() -> None:
    run = fourbar(np.arange(3.0))
    assert coordinates(run, ["rocker.phi", "coupler.*", "coupler.x"]) == (
        "rocker.phi",
        "coupler.x",
        "coupler.y",
        "coupler.phi",
    )
    assert coordinates(run, ["q"]) == coordinates(run, ["qdd"]) == run.names
    assert coordinates(run, ["all"]) == coordinates(run, ["-error"]) == coordinates(run, ["-qd"]) == run.outputs
    assert coordinates(run, ["points", "-A.*"]) == tuple(n for n in run.outputs[run.coordinate_count :] if n[0] != "A")
    assert coordinates(run, ["coupler.v?"]) == ("coupler.x", "coupler.y")
    assert coordinates(run, ["rocker.x", "crank.vy"]) == ("rocker.x", "crank.y")  # fixed ones
    assert coordinates(select(run, ["q"]), ["A.x"]) == ("A.x",)


def test_the_message_of_an_unknown_coordinate_lists_those_there_are() -> None:
    run = fourbar(np.arange(3.0))
    known = "; coordinates: crank.phi, coupler.x, .*, or q, points, all, with [*] for any letters$"
    for name in ("solver.residual", "error", "none", "ram.*", "time"):
        with pytest.raises(RequestError, match=rf"^the run has no coordinate '{re.escape(name)}'{known}"):
            coordinates(run, ["coupler.x", name])
    with pytest.raises(RequestError, match=r"no coordinate 'cupler\.vx'; did you mean 'coupler\.vx'\?; coord"):
        coordinates(run, ["cupler.vx"])
    with pytest.raises(RequestError, match=r"channel 'cupler\.x' is not known"):
        coordinates(run, ["q", "-cupler.x"])


def test_what_is_left_out_is_not_computed() -> None:
    late = dataclasses.replace(whole_run(), margin=never, error=never)
    part = select(late, ["-error", "-margin"], rate=0.5)
    assert part.t.tolist() == [0.0, 2.0, 4.0]
    assert np.isnan(part.margin).all()
    assert part.error.shape == (3, 3)
    assert np.isnan(part.error).all()


def test_a_column_left_out_is_reported_and_one_kept_is_as_it_was() -> None:
    whole = whole_run()
    part = select(whole, ["-coupler.x", "-iterations"])
    with pytest.raises(
        KinfmuError, match=r"^the run does not hold 'coupler\.x': it was not among the channels to keep$"
    ):
        part["coupler.x"]
    np.testing.assert_array_equal(part["coupler.y"], whole["coupler.y"])
    assert np.isnan(part.values[:, 1]).all()
    assert not part.iterations.any()
    assert whole.absent == frozenset()
    assert np.isfinite(whole.values).all()


def test_the_rate_keeps_the_first_sample_of_each_period_and_the_last() -> None:
    t = 0.1 * np.arange(26)
    assert kept_samples(t, None).tolist() == list(range(26))
    assert kept_samples(t, 2.0).tolist() == [0, 5, 10, 15, 20, 25]
    assert kept_samples(t, 4.0).tolist() == [0, 3, 5, 8, 10, 13, 15, 18, 20, 23, 25]
    assert kept_samples(t, 1000.0).tolist() == list(range(26))
    assert kept_samples(t, 1e-9).tolist() == [0, 25]
    assert kept_samples(t[:0], 1.0).tolist() == []
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(KinfmuError, match="samples a second must be positive and finite"):
            kept_samples(t, rate)
