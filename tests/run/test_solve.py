"""`solve`: times, driver values and axes of samples."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import ConstantSpeed, KinfmuError, RelativeAngleDriver, Run
from kinfmu.draw import animate
from kinfmu.draw.plots import _sheet, stacks_of
from kinfmu.errors import LogError, RequestError
from kinfmu.log import read, write_mcap
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.series import groups
from kinfmu.log.viewer.timeline import timeline_of
from kinfmu.plan import compile_plan
from kinfmu.run.axis import axis_of, shown_range
from kinfmu.run.channels import select
from kinfmu.run.verdict import sentence
from tests.mechanisms import bar_linkage, five_bar, fourbar, slider_crank
from tests.oracle import fourbar as exact_fourbar
from tests.oracle import largest_error
from tests.oracle import slider_crank as exact_slider_crank


def test_a_general_fourbar_equals_50_digits() -> None:
    u = list(np.random.default_rng(3).uniform(-20, 20, 60))
    run = kinfmu.solve(fourbar(4, 1, 3.5, 3), crank_angle=u, crank_speed=0.7, crank_acceleration=-0.4)
    exact = exact_fourbar(4, 1, "3.5", 3, u, 0.7, -0.4)
    angles = [run.names.index(name) for name in ("crank.phi", "coupler.phi", "rocker.phi")]
    assert largest_error(run.q[:, angles], exact.q, modulo_turns=True) < 2e-14
    assert largest_error(run.qd[:, angles], exact.qd) < 1e-14
    assert largest_error(run.qdd[:, angles], exact.qdd) < 1e-14


def test_a_distance_in_place_of_the_coupler_moves_the_rocker_the_same() -> None:
    u = np.linspace(-3.0, 9.0, 50)
    run = kinfmu.solve(bar_linkage(), crank_angle=u)
    exact = exact_fourbar(4, 1, "3.5", 3, list(u))
    for ours, theirs in (("rocker.phi", exact.q), ("rocker.omega", exact.qd), ("rocker.alpha", exact.qdd)):
        assert largest_error(run[ours], theirs[:, 2], modulo_turns=True) < 1e-13


def test_a_slider_crank_equals_50_digits() -> None:
    u = np.linspace(0.0, 12.0, 80)
    run = kinfmu.solve(slider_crank(1.0, 3.0, 0.25), crank_angle=u)
    exact = exact_slider_crank(1, 3, "0.25", list(u))
    for ours, theirs in zip(("slider.x", "slider.vx", "slider.ax"), exact, strict=True):
        assert largest_error(run[ours], theirs[:, -1]) < 1e-13


def test_angles_keep_their_turns() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=[0.5, 0.5 + 40 * np.pi, 0.5])
    np.testing.assert_allclose(run["rocker.phi"], [0.5, 0.5 + 40 * np.pi, 0.5], rtol=1e-14)


def test_times_and_inputs_drive_equally() -> None:
    mechanism = kinfmu.load("fourbar")
    t = np.linspace(10.0, 20.0, 5)
    by_time = kinfmu.solve(mechanism, t, parameters={"crank.speed": 0.1, "crank.start": 0.2})
    by_inputs = kinfmu.solve(mechanism, crank_angle=0.2 + 0.1 * t, crank_speed=0.1)
    np.testing.assert_allclose(by_time.values, by_inputs.values, rtol=0, atol=1e-14)
    np.testing.assert_allclose(by_time.rates, by_inputs.rates, rtol=0, atol=1e-14)


def test_given_arrays_are_filled() -> None:
    out = tuple(np.empty((3, 7)) for _ in range(3))
    run = kinfmu.solve(kinfmu.load("fourbar"), [40.0, 50.0, 60.0], out=out)
    assert run.values is out[0]
    assert run.accelerations is out[2]
    with pytest.raises(KinfmuError, match=r"out: values must be float64 of shape \(2, 7\), not float64 of \(3, 7\)"):
        kinfmu.solve(kinfmu.load("fourbar"), [40.0, 50.0], out=out)


def test_chosen_outputs_are_all_that_is_solved() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [40.0], outputs=["coupler.x", "A.y"])
    assert run.outputs == ("coupler.x", "A.y")
    assert run.names == ("coupler.x",)
    plan = compile_plan(kinfmu.load("fourbar"))
    with pytest.raises(KinfmuError, match=r"^outputs are chosen when a plan is compiled: compile_plan\(mechanism, out"):
        kinfmu.solve(plan, [40.0], outputs=["coupler.x"])


def test_two_drivers_take_arrays_and_numbers() -> None:
    run = kinfmu.solve(five_bar(), shoulder_angle=[2.0, 2.1], elbow_angle=1.0, shoulder_speed=0.3, elbow_speed=0.0)
    assert run.inputs.shape == (2, 6)
    assert run.good.all()
    h = 1e-4
    near = kinfmu.solve(five_bar(), shoulder_angle=[2.0 - h, 2.0 + h], elbow_angle=1.0)
    slope = (near["tip.x"][1] - near["tip.x"][0]) / (2 * h) * 0.3
    assert run["tip.vx"][0] == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"crank_speed": 1.0}, "input 'crank_angle' is missing"),
        ({"times": [0.0]}, "times go by t"),
        ({"t": [0.0], "crank_angle": [0.0]}, "give times or inputs, not both"),
        ({"crank_angel": [0.0]}, "did you mean 'crank_angle'"),
        ({"crank_angle": [0.0, np.nan]}, r"crank_angle\[1\] is not a finite number"),
        ({"crank_angle": [0.0, 1.0, 2.0], "crank_speed": [1.0, 2.0]}, "equal lengths or be single numbers"),
        ({"crank_angle": [[0.0]]}, "must be one-dimensional"),
        ({"crank_angle": "fast"}, "crank_angle must be numbers"),
        ({"t": True}, "t must be numbers, not true or false"),
        ({"t": np.array([1j])}, "^t must be numbers, not complex$"),
        ({"crank_angle": np.array([0.0, 1.0 + 1j])}, "^crank_angle must be numbers, not complex$"),
        ({"crank_angle": [0.0, 1.0 + 1j]}, "^crank_angle must be numbers, not complex$"),
        ({"crank_angle": [0.0, 1.0], "crank_speed": 1j}, "^crank_speed must be numbers, not complex$"),
        ({"t": [0.0], "out": (np.zeros((1, 7)),) * 2}, r"^out must be three arrays, .*rates, accelerations\), not 2$"),
        ({"t": [0.0], "out": np.zeros((3, 1, 7))}, "^out must be three arrays, .*, not ndarray$"),
        (
            {"t": [0.0], "out": ([[0.0]],) * 3},
            r"^out: values must be a numpy array, float64 of shape \(1, \d+\), not list$",
        ),
        ({"crank_angle": [0.0, 1.0], "crank_speed": True}, "crank_speed must be numbers, not true or false"),
        ({"t": [0.0], "parameters": {"crank.speed": True}}, "crank.speed = true must be a number"),
        ({"t": [0.0], "engine": "fortran"}, "engine 'fortran' is not known"),
        ({"t": [0.0], "parameters": {"crank.sped": 1.0}}, r"did you mean 'crank\.speed'"),
        ({"t": [0.0], "parameters": {"crank.speed": np.inf}}, "must be a finite number"),
        ({"t": [0.0], "tolerance": -1}, r"^tolerance = -1 must be a positive number$"),
        ({"t": [0.0], "tolerance": 0.0}, r"^tolerance = 0\.0 must be a positive number$"),
        ({"t": [0.0], "tolerance": np.nan}, r"^tolerance = nan must be a positive number$"),
        ({"t": [0.0], "tolerance": np.inf}, r"^tolerance = inf must be a positive number$"),
        ({"t": [0.0], "tolerance": "1e-9"}, r"^tolerance = '1e-9' must be a positive number$"),
    ],
)
def test_wrong_arguments_are_reported_in_one_line(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(KinfmuError, match=message) as caught:
        kinfmu.solve(kinfmu.load("fourbar"), **arguments)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


NO_NUMBERS = {
    "masked array": (np.ma.array([0.1, 5.0, 0.3], mask=[False, True, False]), r"\[1\] is masked; leave it out"),
    "list with a masked number": ([0.1, np.ma.masked, 0.3], r"\[1\] is masked; leave it out"),
    "rows, one masked": ([np.ma.array([0.1, 5.0], mask=[False, True])] * 3, r"\[0, 1\] is masked; leave it out"),
    "dates": (np.array(["2026-01-01", "2026-01-02", "2026-01-03"], dtype="datetime64[s]"), "not dates$"),
    "durations": (np.array([1, 2, 3], dtype="timedelta64[s]"), "not durations; divide them by a unit"),
    "list of durations": ([np.timedelta64(1, "s"), 0.2, 0.3], "not durations; divide them by a unit"),
    "objects that are durations": (np.array([np.timedelta64(1, "s"), 0.2, 0.3], dtype=object), "not durations"),
    "records": (np.array([(0.1,), (0.2,), (0.3,)], dtype=[("a", float)]), "not records of several fields$"),
}


@pytest.fixture(scope="module")
def entries(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Callable[[Any], object]]:
    """Whatever takes arrays, as functions of one of them."""
    mechanism = kinfmu.load("jansen_leg")
    model = kinfmu.compile(mechanism, engine="python")
    fmu = kinfmu.build(mechanism, tmp_path_factory.mktemp("fmu"), flavour="python", drive="inputs")
    (length, *_), (driver,) = mechanism.parameters, mechanism.drivers
    angle, speed, _ = driver.inputs()
    varied: dict[str, dict[str, Any]] = {length: {"values": [1.0]}}
    measured = [kinfmu.measures.Range("lift", "foot.y")]
    loaded = kinfmu.load("fourbar_loaded")
    return {
        "t": lambda values: kinfmu.solve(mechanism, values),
        "angle": lambda values: kinfmu.solve(mechanism, **{angle: values}),
        "speed": lambda values: model.solve(**{angle: [0.1, 0.2, 0.3], speed: values}),
        "sensitivities": lambda values: model.sensitivities(**{angle: values}),
        "designs": lambda values: model.solve_designs({length: values}, [0.0]),
        "angles of designs": lambda values: model.solve_designs({length: [0.1] * 3}, **{angle: values}),
        "measured designs": lambda values: kinfmu.measure_designs(model, {length: values}, measures=measured),
        "angles of measured designs": lambda values: kinfmu.measure_designs(
            model, {length: [0.1] * 3}, measures=measured, **{angle: values}
        ),
        "t of a study": lambda values: kinfmu.study(mechanism, varied, measures=measured, t=values),
        "angles of a study": lambda values: kinfmu.study(mechanism, varied, measures=measured, **{angle: values}),
        "inputs of an FMU": lambda values: kinfmu.simulate(fmu, inputs={"time": [0.0, 1.0, 2.0], angle: values}),
        "times of an FMU": lambda values: kinfmu.simulate(fmu, inputs={"time": values, angle: [0.1, 0.2, 0.3]}),
        "torque": lambda values: kinfmu.simulate(
            loaded, drive="torque", inputs={"time": [0.0, 1.0, 2.0], "crank_torque": values}
        ),
        "times of a torque": lambda values: kinfmu.simulate(
            loaded, drive="torque", inputs={"time": values, "crank_torque": [0.1, 0.2, 0.3]}
        ),
        "cam": lambda values: kinfmu.cam_profile(kinfmu.load("cam_roller"), "pitch", values),
    }


@pytest.mark.parametrize("case", NO_NUMBERS)
@pytest.mark.few(1)
def test_what_numpy_would_make_numbers_of_is_refused_in_one_line(
    case: str, entries: dict[str, Callable[[Any], object]]
) -> None:
    values, message = NO_NUMBERS[case]
    for entry, take in entries.items():
        with pytest.raises(KinfmuError, match=message) as caught:
            take(values)
        assert "\n" not in str(caught.value), entry


def test_arrays_whose_mask_hides_nothing_are_numbers() -> None:
    angles = np.linspace(0.0, 1.0, 5)
    run, same = (kinfmu.solve(kinfmu.load("fourbar"), crank_angle=u) for u in (np.ma.array(angles), angles))
    np.testing.assert_array_equal(run.values, same.values)


@pytest.mark.parametrize("value", [np.timedelta64(1, "s"), np.datetime64("2026-01-01"), np.ma.masked])
def test_single_values_that_are_no_numbers_are_refused(value: Any) -> None:
    mechanism = kinfmu.load("fourbar")
    for take in (
        lambda: kinfmu.solve(mechanism, [0.0], parameters={"crank.speed": value}),
        lambda: kinfmu.solve(mechanism, crank_angle=value),
        lambda: kinfmu.Mechanism("m", [kinfmu.Body("ground", {"O": (value, 0.0)})], [], []),
    ):
        with pytest.raises(KinfmuError) as caught:
            take()
        assert "\n" not in str(caught.value)


def test_masked_tables_are_no_place_for_results() -> None:
    out = tuple(np.ma.zeros((1, 7)) for _ in range(3))
    with pytest.raises(KinfmuError, match=r"^out: values must be a numpy array, .*, not MaskedArray$"):
        kinfmu.solve(kinfmu.load("fourbar"), [0.0], out=out)


def test_the_files_own_run_is_solved_by_default() -> None:
    run = kinfmu.solve(kinfmu.load("double_pendulum"))
    assert (run.t[0], run.t[-1], len(run)) == (0.0, 1.5, 151)
    assert repr(run).startswith("<Run of double_pendulum: 151 samples, t = 0 to 1.5 s, 0 without numbers; upper.x")


def test_a_run_that_lands_on_a_dead_centre_comes_back() -> None:
    degrees = [300.0, 359.0, 360.0, 359.0, 300.0, 180.00001, 370.0, 300.0]
    run = kinfmu.solve(kinfmu.load("double_pendulum"), crank_angle=np.radians(degrees))
    assert run.status.tolist() == [0, 0, 1, 0, 0, 1, 3, 0]
    np.testing.assert_allclose(run["lower.phi"][[3, 4]], run["lower.phi"][[1, 0]], rtol=0, atol=1e-12)
    assert np.isnan(run.residual[6])


@pytest.mark.parametrize("offset", [1e3, -1e5, 1e6])
def test_a_mechanism_far_from_the_origin_moves_as_one_near_by(offset: float) -> None:
    u = np.linspace(-1.0, 7.0, 30)
    near = kinfmu.solve(fourbar(4, 1, 3.5, 3), crank_angle=u)
    far = kinfmu.solve(fourbar(4, 1, 3.5, 3, at=(offset, -2 * offset)), crank_angle=u)
    np.testing.assert_allclose(far["rocker.phi"], near["rocker.phi"], rtol=0, atol=1e-14)
    np.testing.assert_allclose(far["coupler.ax"], near["coupler.ax"], rtol=0, atol=1e-14)
    np.testing.assert_allclose(far["coupler.y"], near["coupler.y"] - 2 * offset, rtol=1e-15)
    assert far.fixed["rocker.x"] == offset + 4.0
    assert kinfmu.check(fourbar(4, 1, 3, 2, at=(offset, 0.0))).singular[0].value == pytest.approx(np.pi, abs=1e-11)


def test_no_samples_are_an_empty_run() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [])
    assert len(run) == 0
    assert run.q.shape == (0, 5)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(
    "arguments",
    [
        {"crank_angle": [0.4, 0.5, 0.6]},
        {"t": [1.0, 2.0, 3.0]},
        {"t": [1.0, 2.0, 3.0], "parameters": {"crank.start": 0.3}},
    ],
    ids=["inputs", "times", "parameters"],
)
@pytest.mark.few(2)
def test_margins_and_error_estimates_are_computed_when_they_are_read(engine: str, arguments: dict[str, object]) -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), engine=engine, **arguments)  # type: ignore[arg-type]  # several kinds
    assert callable(vars(run)["margin"])
    assert callable(vars(run)["error"])
    assert run.margin.shape == (3,)
    assert run.error.shape == (3, 3)
    assert not callable(vars(run)["margin"])
    assert not callable(vars(run)["error"])


def test_a_solve_of_a_plan_resolves_no_mechanism(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = compile_plan(kinfmu.load("fourbar"))
    monkeypatch.setattr(kinfmu.Mechanism, "with_parameters", None)  # calling it fails
    assert kinfmu.solve(plan, crank_angle=[0.4, 0.5]).good.all()


def test_whole_numbers_over_many_turns_are_probably_degrees() -> None:
    mechanism = kinfmu.load("fourbar")
    with pytest.warns(
        UserWarning, match=r"crank_angle: 0 to 359 rad, 57\.1 turns, .* crank_angle=np\.radians\("
    ) as caught:
        kinfmu.solve(mechanism, crank_angle=np.arange(0, 360))
    assert caught[0].filename == __file__
    for angles in (np.radians(np.arange(360)), np.linspace(0.0, 100.0, 360), np.arange(6), [0.0, 360.0], 60.0):
        kinfmu.solve(mechanism, crank_angle=angles)  # a warning is an error here
    kinfmu.solve(mechanism, crank_angle=np.arange(0, 360), wrap=True)


# ----------------------------------------------------------------------------------------------------------------- axis


TURN = np.linspace(0.0, math.tau, 361)


@pytest.fixture(scope="module")
def sweep() -> Run:
    return kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=TURN)


def test_a_run_over_time_has_the_axis_time() -> None:
    axis = axis_of(kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 1.5, 4)))
    assert (axis.label, axis.rates, axis.place(0.5), axis.range()) == ("t [s]", "", "0.5 s", "t = 0 to 1.5 s")


def test_a_sweep_has_its_driver_as_its_axis(sweep: Run) -> None:
    axis = axis_of(sweep)
    assert (axis.label, axis.range(), axis.place(45.0)) == ("crank [deg]", "crank = 0 to 360 deg", "crank = 45 deg")
    np.testing.assert_array_equal(axis.values, np.arange(361.0))
    assert axis.rates == "Rates are derivatives by crank, per rad."


def test_rates_of_a_sweep_have_the_unit_of_the_slope_over_its_driver(sweep: Run) -> None:
    units = {place.name: place.unit for place in sweep.places()}
    assert units["time"] == "1"
    assert (units["rocker.omega"], units["coupler.vx"], units["coupler.ax"]) == ("rad/rad", "mm/rad", "mm/rad2")
    slope = np.gradient(sweep["coupler.x"], np.radians(axis_of(sweep).values))
    np.testing.assert_allclose(slope[1:-1], sweep["coupler.vx"][1:-1], atol=1e-3 * np.ptp(slope))


def test_rates_at_given_speeds_stay_rates_of_time() -> None:
    m = kinfmu.load("crank_rocker")
    at_three = kinfmu.solve(m, crank_angle=TURN, crank_speed=3.0)
    assert axis_of(at_three).rates == "Rates are at the speed crank = 3 rad/s."
    assert {place.unit for place in at_three.places() if place.name == "coupler.vx"} == {"mm/s"}
    faster = kinfmu.solve(m, crank_angle=TURN, crank_speed=TURN + 1.0)
    assert axis_of(faster).rates == "Rates are at the speeds given for crank."
    pushed = kinfmu.solve(m, crank_angle=TURN, crank_acceleration=2.0)
    assert axis_of(pushed).rates == "Rates are at the speed crank = 1 rad/s."


def test_of_several_drivers_the_one_that_moves_is_the_axis() -> None:
    m = kinfmu.load("five_bar")
    start = kinfmu.solve(m, [0.0]).inputs[0]
    left = np.linspace(start[0], start[0] + 0.1, 5)
    one = axis_of(kinfmu.solve(m, left_angle=left, right_angle=start[3]))
    assert (one.label, one.rates) == ("left [deg]", "Rates are at the speeds left = 1 rad/s, right = 1 rad/s.")
    alone = axis_of(kinfmu.solve(m, left_angle=left, right_angle=start[3], right_speed=0.0))
    assert (alone.label, alone.rates) == ("left [deg]", "Rates are derivatives by left, per rad.")
    both = axis_of(kinfmu.solve(m, left_angle=left, right_angle=start[3] + np.linspace(0.0, 0.1, 5)))
    assert (both.label, both.range(), both.place(2.0)) == ("sample", "sample 0 to 4", "sample 2")


@pytest.mark.parametrize("values", [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0]])
def test_there_and_back_the_samples_are_the_axis(values: list[float]) -> None:
    assert axis_of(kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=values)).label == "sample"


@pytest.mark.parametrize("values", [[1e12], [1.0, 0.5, 0.0], [0.0, 1e300]])
def test_any_values_have_an_axis(values: list[float]) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=values)
    axis = axis_of(run)
    assert axis.name == "crank"
    assert np.isfinite(axis.values).all()
    if max(values) > 1e9:
        with pytest.raises(LogError, match=r"^crank \[rad\]: a recording holds values of at most 2147483648$"):
            timeline_of([run])


def test_a_length_is_an_axis_in_the_unit_of_the_file() -> None:
    run = kinfmu.solve(kinfmu.load("parallel_jaw"), piston_position=np.linspace(0.0, 5.0, 11))
    axis = axis_of(run)
    assert (axis.label, axis.per) == ("piston [mm]", "length")
    assert timeline_of([run]).name == "piston [0.1 mm]"
    assert {place.unit for place in run.places() if place.name.endswith(".omega")} == {"rad/mm"}


def test_a_record_keeps_the_axis_whatever_channels_it_keeps(sweep: Run, tmp_path: Path) -> None:
    write_mcap(sweep, tmp_path / "run.mcap", channels=["rocker.*"])
    found = axis_of(read(tmp_path / "run.mcap"))
    assert (found.label, found.rates) == ("crank [deg]", "Rates are derivatives by crank, per rad.")
    np.testing.assert_array_equal(found.values, np.arange(361.0))
    assert "crank_angle" not in select(sweep, ["rocker.*"]).absent


def test_a_part_of_a_sweep_keeps_its_axis(sweep: Run) -> None:
    assert axis_of(sweep.part(slice(30, 61))).range() == "crank = 30 to 60 deg"


def test_pictures_and_reports_say_the_axis(sweep: Run, tmp_path: Path) -> None:
    panels = _sheet([sweep], stacks_of(sweep, ["coupler.x"])).axes
    assert [panel.get_ylabel() for panel in panels] == ["x [mm]", "vx [mm/rad]", "ax [mm/rad²]"]
    assert panels[2].get_xlabel() == "crank [deg]"
    np.testing.assert_array_equal(panels[0].lines[0].get_xdata(), np.arange(361.0))
    assert "361 samples, crank = 0 to 360 deg." in card(sweep)
    assert "derivatives by crank, per rad" in card(sweep)
    assert " at crank = " in sentence(sweep)
    titles = [group.title for group in groups(sweep).values()]
    assert "velocity [mm/rad]" in titles
    animate(sweep.part(slice(None, None, 45)), tmp_path / "run.gif")


@pytest.mark.parametrize(
    ("samples", "name"), [(361, "crank [deg]"), (721, "crank [0.1 deg]"), (100, "crank [0.01 deg]")]
)
def test_a_recording_counts_parts_of_the_drivers_unit(samples: int, name: str) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.linspace(0.0, math.tau, samples))
    timeline = timeline_of([run])
    assert timeline.name == name
    placed = timeline.placed(run).t / (timeline.parts or 0)
    np.testing.assert_allclose(placed, axis_of(run).values, atol=0.01 * 360.0 / (samples - 1))


def test_runs_over_different_axes_are_not_compared(sweep: Run) -> None:
    over_time = kinfmu.solve(kinfmu.load("crank_rocker"), [0.0, 1.0])
    with pytest.raises(LogError, match=r"crank \[deg\] and t \[s\]; runs over the same axis can be compared"):
        timeline_of([sweep, over_time])


def test_events_are_placed_on_the_axis() -> None:
    run = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=np.radians([70.0, 80.0, 90.0]))
    (event,) = timeline_of([run]).placed(run).events
    assert event.t == 90.0
    assert "**left = 90 deg:**" in card(run)


def test_an_unknown_axis_of_a_record_is_time(sweep: Run) -> None:
    for axis in ("future", "crank_speed", "crank_acceleration"):
        other = dataclasses.replace(sweep, axis=axis)
        assert axis_of(other).label == "t [s]"
        assert {place.unit for place in other.places() if place.name == "coupler.vx"} == {"mm/s"}


@pytest.mark.parametrize(
    ("start", "stop", "count"), [("30deg", "60deg", 31), (None, "1rad", 58), ("0.5rev", None, 181)]
)
def test_a_part_of_a_sweep_is_chosen_by_its_driver(sweep: Run, start: str | None, stop: str | None, count: int) -> None:
    from kinfmu.cli.export_formats import samples_between

    assert len(samples_between(sweep, start, stop)) == count


def test_a_part_that_a_sweep_has_not_is_refused(sweep: Run) -> None:
    from kinfmu.cli.export_formats import samples_between

    with pytest.raises(RequestError, match=r"no samples from 720 deg on; its samples: crank = 0 to 360 deg"):
        samples_between(sweep, "720deg", None)


def test_the_largest_numbers_have_the_default_range() -> None:
    largest = np.finfo(float).max
    few = np.array([-largest, *np.linspace(-0.4, 0.4, 4000) * largest, largest])
    assert shown_range(few, 1.0) is None
    assert shown_range(np.array([*np.linspace(-1.0, 1.0, 4000), 1e300]), 1.0) == pytest.approx((-2.0, 2.0), rel=0.05)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("between", [("crank", "coupler"), ("coupler", "rocker"), ("rocker", "crank")])
@pytest.mark.few(2)
def test_a_motor_between_two_bodies_of_a_loop_moves_it_as_the_crank_does(between: tuple[str, str], engine: str) -> None:
    """The block of the loop has the driver's value in its Jacobian."""
    by_crank = fourbar(4.0, 1.0, 3.5, 3.0)
    given = kinfmu.solve(by_crank, crank_angle=np.linspace(1.0, 1.6, 40), crank_speed=2.0, crank_acceleration=-3.0)
    i, j = between
    driver = RelativeAngleDriver("motor", between, ConstantSpeed(given[f"{j}.phi"][0] - given[f"{i}.phi"][0], 1.0))
    inputs = {
        f"motor_{name}": given[f"{j}.{of}"] - given[f"{i}.{of}"]
        for name, of in (("angle", "phi"), ("speed", "omega"), ("acceleration", "alpha"))
    }
    run = kinfmu.solve(dataclasses.replace(by_crank, drivers=(driver,)), engine=engine, **inputs)
    np.testing.assert_array_equal(run.status, 0)
    for table in ("values", "rates", "accelerations"):
        apart = getattr(run, table) - getattr(given, table)[:, [given.outputs.index(name) for name in run.outputs]]
        assert np.abs(apart).max() < 1e-12
