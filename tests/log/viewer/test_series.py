"""Curves of recordings: grouped by unit, of forces, and the parameters in which runs differ."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.scene import drawable
from kinfmu.log import read, write_rrd
from kinfmu.log.viewer.blueprint import Drawn, free_corner, plot, single
from kinfmu.log.viewer.card import parameters_apart
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.log.viewer.linkage import view_box
from kinfmu.log.viewer.series import SMALLEST, Group, accuracy, efforts, error_estimates, groups, margin, reactions
from kinfmu.log.viewer.timeline import timeline_of
from kinfmu.run import Run
from kinfmu.run.components import mechanism_info
from tests.log.runs import fourbar, with_gap
from tests.log.viewer.test_rerun_file import SCALARS, documents, rows, statics
from tests.run.test_forces import loaded


def test_curves_are_grouped_by_unit(run: Run) -> None:
    found = groups(run)
    assert [group.title for group in found.values()] == [
        "angle [deg]",
        "angular velocity [deg/s]",
        "angular acceleration [deg/s2]",
        "position [m]",
        "velocity [m/s]",
        "acceleration [m/s2]",
    ]
    assert found["velocity", "angle"].names == ("crank.omega", "coupler.omega", "rocker.omega")
    assert found["acceleration", "length"].names == ("coupler.ax", "coupler.ay", "A.ax", "A.ay")
    np.testing.assert_array_equal(found["position", "length"].values[:, 1], run["coupler.y"])


def test_the_unit_of_length_is_the_mechanisms_own(run: Run) -> None:
    assert groups(dataclasses.replace(run, length_unit="mm"))["velocity", "length"].title == "velocity [mm/s]"


def test_curves_have_the_colours_of_their_bodies(run: Run) -> None:
    found = groups(run)
    assert found["position", "angle"].colours == palette.BODIES[:3]
    blue = palette.BODIES[1]
    assert found["position", "length"].colours[:2] == (blue, palette.lighter(blue))


def test_every_one_of_many_curves_has_a_name_and_a_colour_of_its_own_and_no_legend_covers_them() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar_chain:9"), [0.0, 1.0])
    for group in groups(run).values():
        assert len(group.names) > 14
        assert len({*group.names}) == len({*group.colours}) == len(group.names)
        (is_shown,) = (
            plot(group.title, [("", group)], timeline_of([run]), [run])
            .properties["PlotLegend"]
            .visible.as_arrow_array()
        )
        assert not is_shown.as_py()


def test_two_curves_without_a_free_corner_have_a_legend_above_them(run: Run) -> None:
    waves = np.column_stack([np.sin(run.t), -np.sin(run.t)])
    group = Group("x", "x", ("first_crank.x", "second_crank.x"), palette.BODIES[:2], waves)
    view = plot("x", [("", group)], timeline_of([run]), [run])
    (is_shown,) = view.properties["PlotLegend"].visible.as_arrow_array()
    ((low, high),) = view.properties["ScalarAxis"].range.as_arrow_array().to_pylist()
    assert is_shown.as_py()
    assert low < -1.0
    assert high > 1.5


def test_a_single_curve_is_named_by_its_plot(run: Run) -> None:
    (is_shown,) = (
        plot("margin", [("", margin(run))], timeline_of([run]), [run]).properties["PlotLegend"].visible.as_arrow_array()
    )
    assert not is_shown.as_py()


def test_what_is_constant_has_no_plot_and_is_listed_with_its_value(run: Run, tmp_path: Path) -> None:
    found = groups(run)
    assert [key for key, group in found.items() if group.is_constant] == [
        ("velocity", "angle"),
        ("acceleration", "angle"),
    ]
    assert found["position", "angle"].constants == {"coupler.phi": 0.0}
    layout = single(timeline_of([run]), run, [], found, [], [])
    assert [view.name for view in views(layout.root_container) if "[" in view.name] == [
        "angle [deg]",
        "position [m]",
        "velocity [m/s]",
        "acceleration [m/s2]",
    ]
    write_rrd(run, tmp_path / "run.rrd")
    (text,) = documents(tmp_path / "run.rrd", "/card")
    assert "| crank.omega | 1 deg/s |" in text
    assert "| coupler.alpha | 0 deg/s2 |" in text
    assert not any(group.is_constant for group in groups(fourbar(np.array([60.0]))).values())


def test_equal_curves_are_drawn_over_wider_ones(run: Run, tmp_path: Path) -> None:
    assert groups(run)["position", "angle"].widths() == [4.5, 1.5, 1.5]  # crank and rocker have equal angles
    write_rrd(run, tmp_path / "run.rrd")
    assert statics(tmp_path / "run.rrd", "/position/angle", "SeriesLines:widths") == [4.5, 1.5, 1.5]


def test_the_tab_of_the_solver_is_in_front_if_a_sample_is_not_ok(run: Run) -> None:
    for shown, front in ((run, "solver"), (fourbar(np.arange(10.0, 20.0)), "motion")):
        layout = single(timeline_of([shown]), shown, [], groups(shown), [], [accuracy(shown)])
        _, tabs = layout.root_container.contents
        assert [tab.name for tab in tabs.contents] == ["motion", "solver"]
        assert tabs.contents[tabs.active_tab].name == front
        names = [view.name for view in views(tabs.contents[1])]
        assert names == ["solver status", *(["log"] if front == "solver" else []), "log10 residual"]


def test_a_legend_is_in_a_corner_without_curves_or_closed(run: Run) -> None:
    def corner(*curves: Any, names: str = "ab") -> str | None:
        values = np.column_stack([*curves, *[curves[0]] * (len(names) - len(curves))])
        group = Group("x", "x", tuple(names), ((0, 0, 0),) * len(names), values)
        return free_corner([group], [run], (0.0, 1.0), 300.0, 200.0)

    rising = run.t / 180.0
    assert corner(rising) == "LeftTop"
    assert corner(1.0 - rising) == "RightTop"
    assert corner(np.full(181, 0.9), np.where(run.t < 90.0, 0.1, 0.9)) == "RightBottom"
    assert corner(rising, 1.0 - rising, np.where(run.t < 90.0, 0.02, 0.98), names="abc") is None
    assert corner(0.5 + 0.5 * np.sin(run.t), 0.5 - 0.5 * np.sin(run.t)) is None
    assert corner(rising, names="a") is None
    assert corner(rising, names="abcdefghij") is None  # higher than the plot
    assert corner(np.full(181, np.nan)) == "RightTop"


def test_a_gap_is_not_a_number_even_if_the_run_holds_some(run: Run) -> None:
    lost = dataclasses.replace(run, status=np.where(run.t == 7.0, 3, run.status))
    assert np.isnan(groups(lost)["position", "angle"].values[7]).all()


def test_round_off_is_drawn_as_a_line_at_zero(run: Run) -> None:
    noise = np.random.default_rng(1).normal(scale=1e-17, size=run.accelerations.shape)
    found = groups(dataclasses.replace(run, accelerations=run.accelerations + noise))
    usual = 180.0 / 180.0**2  # the largest angle [deg] over the square of the run's time
    assert found["acceleration", "angle"].shown == pytest.approx((-usual, usual))
    assert found["acceleration", "length"].shown is None


def test_a_sample_near_a_singular_point_does_not_flatten_the_others(run: Run) -> None:
    accelerations = run.accelerations.copy()
    accelerations[100, 1] = -1e22
    found = groups(dataclasses.replace(run, accelerations=accelerations))["acceleration", "length"]
    assert found.shown
    assert found.shown[0] < run.accelerations.min()
    assert found.shown[1] > run.accelerations.max()
    assert found.shown[1] - found.shown[0] < 3 * np.ptp(run.accelerations)
    assert found.values[100, 0] == -1e22


def test_the_axis_is_left_to_the_viewer_where_nothing_misleads(run: Run) -> None:
    assert groups(run)["position", "length"].shown is None
    assert groups(with_gap(run, 0, 180))["position", "length"].shown is None


def test_a_value_alone_between_gaps_makes_points(run: Run) -> None:
    assert not groups(run)["position", "angle"].is_scattered
    assert not groups(with_gap(run, 3, 5))["position", "angle"].is_scattered
    assert groups(with_gap(with_gap(run, 3, 3), 5, 5))["position", "angle"].is_scattered
    assert groups(fourbar(np.array([60.0])))["position", "angle"].is_scattered


def test_a_residual_of_zero_is_drawn_below_round_off(run: Run) -> None:
    exact = dataclasses.replace(run, residual=np.where(run.t == 5.0, 0.0, 1e-16))
    group = accuracy(exact)
    assert group.names == ("residual", "watch")
    assert group.values[4:6, 0] == pytest.approx([-16.0, np.log10(SMALLEST)])


def test_errors_are_drawn_where_they_are_estimated(run: Run) -> None:
    group = error_estimates(run)
    assert group
    assert np.flatnonzero(np.isfinite(group.values).all(axis=1)).tolist() == [0, 180]
    assert group.is_scattered
    assert error_estimates(dataclasses.replace(run, error=np.zeros_like(run.error))) is None


def test_efforts_and_energies_have_a_plot_for_each_unit() -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.1, 21))
    found = efforts(run)
    assert [group.title for group in found] == ["crank.torque [N m]", "crank.power [W]", "energy [J]"]
    assert found[0].names == ("crank.torque",)  # the bias at a constant speed is the torque, and would hide it
    faster = kinfmu.solve(loaded("slider_crank"), crank_angle=np.linspace(0.0, 0.1, 21), crank_acceleration=3.0)
    assert efforts(faster)[0].names == ("crank.torque", "crank.bias_torque")
    np.testing.assert_array_equal(found[2].values[:, 0], run["kinetic_energy"])
    kept = efforts(run.without(["crank.torque", "crank.bias_torque"]))
    assert [group.path for group in kept] == ["forces/power", "forces/energy"]


def test_a_run_without_masses_has_no_plot_of_forces(run: Run) -> None:
    assert efforts(run) == []


# --------------------------------------------------------------------------------------------------------- force curves


def test_a_recording_has_curves_of_reactions_with_names_and_arrows_with_a_scale(tmp_path: Path) -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 1.0, 41))
    force, moment = reactions(run)
    joints = list(dict.fromkeys(name.owner for name in run.reaction_names if name.owner))
    assert (force.title, moment.title) == ("joint force [N]", "joint moment [N m]")
    assert list(force.names) == [*joints, "shaking"]
    path = tmp_path / "run.rrd"
    write_rrd(run, path)
    assert statics(path, "/reactions/force", "SeriesLines:names") == list(force.names)
    recorded = np.array([values for _, values in rows(path, "/reactions/force", SCALARS)])
    first = np.hypot(run[f"{joints[0]}.force_x"], run[f"{joints[0]}.force_y"])
    np.testing.assert_allclose(recorded[:, 0], first, rtol=1e-12)
    shaking = np.hypot(run["shaking_force_x"], run["shaking_force_y"])
    np.testing.assert_allclose(recorded[:, -1], shaking, rtol=1e-12)
    assert list(moment.names)[-1] == "shaking"
    (label,) = statics(path, "/linkage/forces/legend", "Arrows2D:labels")
    (along,) = statics(path, "/linkage/forces/legend", "Arrows2D:vectors")
    newton, unit = str(label).split()
    assert unit == "N"
    per_newton = np.hypot(*np.array(along, float)) / float(newton)  # the scale of all arrows
    pin = f"/linkage/forces/joints/{joints[0]}"
    assert statics(path, pin, "Arrows2D:labels") == [joints[0]]
    arrows = np.array([vectors[0] for _, vectors in rows(path, pin, "Arrows2D:vectors")], float)  # type: ignore[index]
    np.testing.assert_allclose(np.hypot(*arrows.T), first * per_newton, rtol=1e-5)


def test_undetermined_and_missing_reactions_have_no_curves(run: Run) -> None:
    assert reactions(run) == []  # without masses
    four = kinfmu.solve(loaded("fourbar"), np.linspace(0.0, 1.0, 11))
    named = {name for group in reactions(four) for name in group.names}
    assert named == {"shaking"}  # the redundant bar shares all loads
    crank = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 1.0, 11))
    left_out = [name for name in crank.reaction_names if name.owner == crank.reaction_names[0].owner]
    kept = {name for group in reactions(crank.without(left_out)) for name in group.names}
    assert crank.reaction_names[0].owner not in kept


def views(part: Any) -> Iterator[Any]:
    """The views in a container of a layout."""
    for inner in getattr(part, "contents", ()) if hasattr(part, "grid_columns") else ():
        yield from views(inner)
    if not hasattr(part, "grid_columns"):
        yield part


def test_the_view_shows_all_arrows() -> None:
    run = kinfmu.solve(kinfmu.load("excavator_loaded"))
    shown, _ = drawable(run)
    assert shown is not None
    drawn = Drawn("linkage", "/linkage", run, shown)
    found = drawn.arrows
    assert found is not None
    layout = single(timeline_of([run]), run, [drawn], {}, [], [])
    (view,) = (view for view in views(layout.root_container) if view.name == "linkage")
    (bounds,) = view.properties["VisualBounds2D"].range.as_arrow_array().to_pylist()
    (x0, x1), (y0, y1) = bounds["x_range"], bounds["y_range"]
    assert x0 < view_box(shown)[0][0]  # of the linkage alone
    for name, along in found.along.items():
        x, y = (found.at[name] + along).T
        assert x0 < np.nanmin(x) <= np.nanmax(x) < x1, name
        assert y0 < np.nanmin(-y) <= np.nanmax(-y) < y1, name


# ----------------------------------------------------------------------------------------------------------- parameters


WHEEL = """
name = "wheel"
units.length = "mm"
parameters = { r = "30 mm", half = "r/2", tilt = "30 deg", push = "2 kN", copies = 3 }
bodies.ground.points = { O = [0, 0] }
bodies.crank = { points = { O = [0, 0], P = ["r", "half"] }, start = { phi = "60 deg" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
drivers.m = { type = "angle", of = "crank", law = "constant_speed", start = "tilt", speed = "60 rpm" }
loads.weight = { type = "force", at = "crank.P", x = 0, y = "-push*copies" }
run = { stop = 0.5, step = 0.1 }
"""
SPEED = ("m.speed", "6.28319 rad/s (60 rpm)", "7.33038 rad/s (70 rpm)")


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with wheel.toml in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wheel.toml").write_text(WHEEL, encoding="utf-8")
    return tmp_path


def recorded(*arguments: str) -> Run:
    """The run that a command writes."""
    result = CliRunner().invoke(main, [*arguments, "-o" if arguments[0] == "solve" else "--mcap", "run.mcap"])
    assert result.exit_code == 0, result.stderr
    return read("run.mcap")


@pytest.mark.parametrize("command", ["simulate", "solve"])
@pytest.mark.few(1)
def test_parameters_and_law_constants_are_compared_with_units(command: str, wheel: Path) -> None:
    assert wheel.is_dir()
    a = recorded("simulate", "wheel.toml")
    settings = ("r=35mm", "m.speed=70rpm", "tilt=20deg", "push=2500N", "copies=4")
    b = recorded(command, "wheel.toml", *(word for setting in settings for word in ("--set", setting)))
    assert parameters_apart(a, b) == [  # not half, which follows from r
        ("r", "30 mm", "35 mm"),
        ("tilt", "0.523599 rad (30 deg)", "0.349066 rad (20 deg)"),
        ("push", "2000 N", "2500 N"),
        ("copies", "3", "4"),
        SPEED,
    ]
    assert parameters_apart(a, a) == []


def test_an_fmu_with_a_setting_is_compared_with_its_file(wheel: Path) -> None:
    kinfmu.build(kinfmu.load("wheel.toml"), wheel / "wheel.fmu", flavour="python")
    a = recorded("simulate", "wheel.toml")
    b = recorded("simulate", "wheel.fmu", "--set", "m.speed=70rpm", "--set", "solver.tolerance=1e-8")
    assert parameters_apart(a, b) == [SPEED, ("solver.tolerance", "-", "1e-08")]


def test_units_are_those_of_the_file_while_a_run_has_them() -> None:
    mechanism = kinfmu.mechanism.toml_file.parse(WHEEL)
    a, b = (kinfmu.solve(mechanism, parameters=values) for values in ({}, {"push": 3e3, "tilt": "40 deg"}))
    assert parameters_apart(a, b) == [
        ("tilt", "30 deg", "40 deg"),
        ("push", "2 kN", "3 kN"),
    ]


def test_numbers_are_never_shown_with_the_same_digits() -> None:
    mechanism = kinfmu.mechanism.toml_file.parse(WHEEL)
    a, b = (kinfmu.solve(mechanism, parameters={"r": r}) for r in (30.0, 30.0 + 1e-7))
    assert parameters_apart(a, b) == [("r", "30 mm", "30.0000001 mm")]


def test_the_mechanisms_of_a_system_are_compared_under_the_names_of_their_columns() -> None:
    a = kinfmu.solve(kinfmu.mechanism.toml_file.parse(WHEEL))
    of_a, of_b = (mechanism_info("wheel", [("slide", WHEEL.replace("30 mm", length))]) for length in ("30 mm", "40 mm"))
    a, b = (replace(a, info={"parameters": given, **info}) for given, info in (("", of_a), ("slide.r = 40", of_b)))
    assert parameters_apart(a, b) == [("slide.r", "30 mm", "40 mm")]


def test_what_a_damaged_record_holds_of_its_mechanism_is_not_compared() -> None:
    run = replace(kinfmu.solve(kinfmu.mechanism.toml_file.parse(WHEEL)), info={"g": "1"}, mechanism_source="name = ")
    assert parameters_apart(run, replace(run, info={"g": "2", "note": "x"})) == [("g", "1", "2"), ("note", "-", "x")]


def test_the_table_follows_the_names_of_the_runs(wheel: Path) -> None:
    a = recorded("simulate", "wheel.toml")
    b = recorded("simulate", "wheel.toml", "--set", "r=35mm")
    write_comparison(a, b, wheel / "both.rrd")
    (text,) = documents(wheel / "both.rrd", "/card")
    table = "| parameter | A | B |\n|---|---:|---:|\n| r | 30 mm | 35 mm |"
    title, of_a, of_b, third, *_ = text.split("\n\n")
    assert (title, of_a[:5], of_b[:5], third) == ("### B - A", "**A**", "**B**", table)
