"""The axis of a run: time, or the driver that a sweep moves; rates are labelled as what they are."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Run
from kinfmu.draw import animate
from kinfmu.draw.plots import _sheet
from kinfmu.draw.stacks import stacks_of
from kinfmu.errors import LogError, RequestError
from kinfmu.log import read, write_mcap
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.series import groups
from kinfmu.log.viewer.timeline import timeline_of
from kinfmu.run.axis import axis_of, shown_range
from kinfmu.run.channels import select
from kinfmu.run.verdict import sentence

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
