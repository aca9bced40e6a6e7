"""Plots over a run, and jumps in those of a cam's motion."""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw import plot
from kinfmu.draw.chart import (
    axis_label,
    degree_ticks,
    equal_below,
    gaps,
    label_size,
    numbers,
    repeated,
    round_ticks,
    rows_of,
)
from kinfmu.draw.overlay import overlay, overlay_sheet
from kinfmu.draw.plots import _sheet, _shown, _title_of, main_panels, moving, stacks_of, usual_coordinates
from kinfmu.draw.svaj_figure import _sheet as _svaj_sheet
from kinfmu.draw.svaj_figure import driver_axis
from kinfmu.errors import FigureError, RequestError
from kinfmu.motion.motion_curve import motion_curve, svaj_columns
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.channels import select
from kinfmu.units import CoordinateName, ForceName, Quantity
from tests.log.runs import fourbar, with_gap
from tests.motion.cams import followers
from tests.run.test_forces import loaded


def test_each_coordinate_is_three_panels_with_its_numbers_and_units(run: Run) -> None:
    panels = _sheet([run], stacks_of(run, ["coupler.x", "rocker.phi"])).axes
    assert [panel.get_ylabel() for panel in panels] == [
        "x [m]",
        "vx [m/s]",
        "ax [10⁻⁶ m/s²]",
        "φ [rad]",
        "ω [rad/s]",
        "\N{GREEK SMALL LETTER ALPHA} [10⁻⁶ rad/s²]",
    ]
    assert [panel.get_title(loc="left") for panel in panels] == ["coupler.x", "", "", "rocker.φ", "", ""]
    for panel, name in zip(panels, ("coupler.x", "coupler.vx", "coupler.ax"), strict=False):
        np.testing.assert_array_equal(panel.lines[0].get_xydata(), np.column_stack([run.t, run[name]]))


def written(path: Path) -> list[str]:
    """The texts of a figure."""
    return re.findall(r">([^<>]+)</text>", path.read_text(encoding="utf-8"))


def test_without_names_six_panels_are_drawn_and_lines_name_what_is_constant_and_what_else_moves(
    run: Run, tmp_path: Path
) -> None:
    plot(run, tmp_path / "run.svg")
    texts = written(tmp_path / "run.svg")
    assert [text for text in texts if text in run.outputs] == ["A.x", "A.y"]
    assert "constant: crank.ω = 1 deg/s, coupler.φ = 0 deg, rocker.ω = 1 deg/s" in texts
    assert "not drawn: crank.φ, rocker.φ" in texts
    plot(run, tmp_path / "rad.svg", degrees=False)
    assert any("crank.ω = 0.01745 rad/s" in text for text in written(tmp_path / "rad.svg"))


def drawn(run: Run) -> tuple[dict[str, list[str]], list[str]]:
    """The columns of the panels by title, and the names of what else moves."""
    stacks, others = main_panels(run, moving([run], stacks_of(run, []), keeps_one=False)[0])
    return {stack.title: [panel.column for panel in stack.panels] for stack in stacks}, others


def test_the_first_effort_and_what_slides_are_among_the_six_panels() -> None:
    shown, others = drawn(kinfmu.solve(kinfmu.load("engine"), np.linspace(0.0, 0.04, 101)))
    assert shown == {
        "piston.y": ["piston.y", "piston.vy", "piston.ay"],
        "crank": ["crank.torque", "crank.power"],
        "rod.phi": ["rod.phi"],
    }
    assert others == ["crank.phi", "rod.x", "rod.y", "crank.reduced_inertia", "kinetic_energy", "potential_energy"]
    shown, others = drawn(kinfmu.solve(kinfmu.load("jansen_leg"), np.linspace(0.0, 1.0, 101)))
    assert list(shown) == ["foot.x", "foot.y"]
    names = ("crank", "upper_rod", "upper_triangle", "lower_rod", "lower_rocker", "link", "leg")
    assert others == [f"{name}.phi" for name in names]


def test_constants_have_no_panels_unless_all_that_is_named_is_constant(run: Run, tmp_path: Path) -> None:
    plot(run, tmp_path / "run.svg", ["rocker.phi"])
    texts = written(tmp_path / "run.svg")
    assert {"φ [deg]", "constant: rocker.ω = 1 deg/s"} <= {*texts}
    assert not any(text.startswith(("ω [", "not drawn")) for text in texts)
    plot(run, tmp_path / "run.svg", ["rocker.x"])
    assert {"rocker.x", "x [m]"} <= {*written(tmp_path / "run.svg")}
    stacks, constant = moving([run], stacks_of(run, ["coupler.phi", "A.x"]), keeps_one=False)
    assert ([stack.title for stack in stacks], [panel.column for panel in constant]) == (["A.x"], ["coupler.phi"])


def test_equal_curves_of_a_panel_are_wider_below() -> None:
    rising, falling = np.linspace(0.0, 1.0, 11), np.linspace(1.0, 0.0, 11)
    assert equal_below([rising, falling, rising + 1e-4, rising]) == [2, 0, 1, 0]
    gap = np.where(np.arange(11) == 3, np.nan, rising)
    assert equal_below([rising, gap, gap + 0.0]) == [0, 1, 0]


def test_ticks_are_steps_of_1_2_or_5() -> None:
    axes = Figure().subplots()
    for low, high in ((0.0, 180.0), (0.1, 0.8), (-3.3, 11.0), (1e-6, 7e-6)):
        axes.set_ylim(low, high)
        round_ticks(axes.yaxis, 5, "mm")
        step = float(np.diff(axes.get_yticks())[0])
        assert f"{step:.9e}"[:11] in ("1.000000000", "2.000000000", "5.000000000")
    axes.set_ylim(0.0, 100.0)
    round_ticks(axes.yaxis, 5, "deg")
    assert np.diff(axes.get_yticks())[0] == 30.0


def test_without_points_of_interest_all_coordinates_are_plotted_and_sliders_always(run: Run) -> None:
    bare = dataclasses.replace(
        run,
        outputs=run.names,
        values=run.values[:, : len(run.names)],
        rates=run.rates[:, : len(run.names)],
        accelerations=run.accelerations[:, : len(run.names)],
    )
    assert usual_coordinates(bare) == list(run.names)
    mechanism = kinfmu.load("slider_crank")
    mechanism = dataclasses.replace(mechanism, points={"middle": "crank.P"})
    chosen = usual_coordinates(kinfmu.solve(mechanism, crank_angle=[0.0, 1.0]))
    assert chosen == ["crank.phi", "rod.phi", "piston.x", "middle.x", "middle.y"]


def test_equal_places_are_drawn_once_and_angles_always(tmp_path: Path) -> None:
    mechanism = kinfmu.load("slider_crank")
    run = kinfmu.solve(replace(mechanism, points={"pin": "rod.S", "same": "rod.S"}), np.linspace(0.0, 0.1, 61))
    plot(run, tmp_path / "run.svg")
    texts = written(tmp_path / "run.svg")
    assert [text for text in texts if text in run.outputs or text == "rod.φ"] == ["pin.x", "rod.φ"]
    assert "not drawn: crank.φ, same.x (= pin.x), piston.x (= pin.x)" in texts
    other = kinfmu.solve(replace(mechanism, points={"pin": "rod.S", "same": "crank.P"}), np.linspace(0.0, 0.1, 61))
    assert "same.x" not in usual_coordinates(run)
    assert "same.x" in usual_coordinates(run, other)  # of two runs places must be equal in both
    assert "piston.x" not in usual_coordinates(run, other)
    still = kinfmu.solve(mechanism, crank_angle=[0.0])
    assert repeated(still, still.outputs) == {}


def test_names_of_axes_stay_off_numbers_and_numbers_differ() -> None:
    axes = Figure().subplots()
    axes.set_ylim(0.0005, 0.00131)
    assert numbers(axes, "kg m²") == "10⁻³ kg m²"
    texts = [axes.yaxis.get_major_formatter()(tick) for tick in axes.get_yticks()]
    assert max(map(len, texts)) <= 6
    np.testing.assert_allclose([float(text) for text in texts], 1e3 * axes.get_yticks(), atol=1e-9)
    for low, high in ((1000.1, 1000.4), (-0.3, 0.3), (-23000.0, 40000.0)):
        axes.set_ylim(low, high)
        assert numbers(axes, "1") == "1"
        texts = [axes.yaxis.get_major_formatter()(tick) for tick in axes.get_yticks()]
        np.testing.assert_allclose(
            [float(text.replace("\N{MINUS SIGN}", "-")) for text in texts], axes.get_yticks(), atol=1e-9
        )
    assert axis_label("reduced_inertia", "kg m2", 19) == "reduced_inertia\n[kg m²]"
    assert axis_label("torque", "N m", 19) == "torque [N m]"
    assert axis_label("reduced_inertia.stick_cylinder", "kg", 20) == "reduced_inertia.\nstick_cylinder [kg]"
    assert label_size("a" * 40, 20, 8.0) == 4.0


@pytest.mark.parametrize("name", ["excavator_loaded", "jansen_leg_loaded", "fourbar_chain"])
@pytest.mark.few(1)
def test_names_of_axes_stay_off_each_other_and_within_the_sheet(name: str) -> None:
    mech = kinfmu.load(name)
    run = kinfmu.solve(mech, np.linspace(mech.run.start, mech.run.stop, 30))
    longest = {
        unit: max((c for c, u in run.column_units().items() if u == unit), key=len, default="")
        for unit in ("m", "rad", "N")
    }
    overlaid = [column for column in longest.values() if column and column not in run.absent]
    for made in (
        _sheet((run,), stacks_of(run, [])),
        overlay_sheet(overlay((run,), ("A", "B"), overlaid, (), degrees=False, polar=False)),
    ):
        canvas = FigureCanvasAgg(made)
        canvas.draw()
        labels = [axes.yaxis.label for axes in made.axes if axes.get_ylabel()]
        boxes = [label.get_window_extent(canvas.get_renderer()) for label in labels]
        assert len(boxes) >= 2
        for (one, a), (other, b) in combinations(zip(labels, boxes, strict=True), 2):
            apart = a.x1 <= b.x0 or b.x1 <= a.x0 or a.y1 <= b.y0 or b.y1 <= a.y0
            assert apart, (one.get_text(), other.get_text())
        assert all(box.x0 >= 0.0 and box.y0 >= 0.0 and box.y1 <= made.bbox.y1 for box in boxes)


@pytest.mark.parametrize("span", [1.3, 9.0, 27.0, 36.0, 54.0, 90.0, 100.0, 135.0, 180.0, 270.0, 360.0, 720.0, 1440.0])
@pytest.mark.parametrize("most", [6, 9])
def test_ticks_of_degrees_are_round(span: float, most: int) -> None:
    axes = Figure().subplots()
    axes.set_xlim(-0.01 * span, 1.01 * span)
    degree_ticks(axes.xaxis, most)
    steps = np.diff(axes.get_xticks())
    assert np.ptp(steps) < 1e-9
    assert steps[0] in (0.2, 0.25, 0.5, 1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360)
    assert 2 <= span / steps[0] <= most + 1


def test_the_same_run_gives_the_same_bytes(run: Run, tmp_path: Path) -> None:
    for name in ("a.svg", "b.svg", "a.png", "b.png", "a.pdf", "b.pdf"):
        plot(run, tmp_path / name, ["A.x"])
    for suffix in ("svg", "png", "pdf"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_a_gap_breaks_the_curve_on_a_tinted_ground(run: Run) -> None:
    gap = with_gap(run, 100, 120)
    assert gaps(gap, gap.t) == [(99.0, 121.0)]
    assert gaps(with_gap(run, 0, 180), run.t) == [(0.0, 180.0)]
    assert gaps(with_gap(with_gap(run, 0, 3), 170, 180), run.t) == [(0.0, 4.0), (169.0, 180.0)]
    assert gaps(run, run.t) == []
    panel = _sheet([gap], stacks_of(gap, ["coupler.x"])).axes[0]
    assert len(panel.patches) == 1
    assert np.flatnonzero(np.isnan(panel.lines[0].get_ydata())).tolist() == list(range(100, 121))


def test_noise_about_a_constant_is_a_straight_line(run: Run) -> None:
    noise = 1e-16 * np.random.default_rng(3).normal(size=len(run))
    values = run.values + noise[:, None] * (np.array(run.outputs) == "coupler.phi")
    noisy = dataclasses.replace(run, values=values)
    shown = _shown(noisy, axis_of(noisy), stacks_of(noisy, ["coupler.phi"])[0].panels[0], noisy["coupler.phi"])
    assert shown
    assert shown[1] - shown[0] > 1.0
    low, high = _shown(run, axis_of(run), stacks_of(run, ["crank.phi"])[0].panels[1], run["crank.omega"]) or (0.0, 0.0)
    assert low < run["crank.omega"][0] < high
    assert _shown(run, axis_of(run), stacks_of(run, ["coupler.x"])[0].panels[0], run["coupler.x"]) is None


def test_a_long_run_is_drawn_by_its_extremes() -> None:
    values = np.random.default_rng(5).normal(size=100_000)
    values[40_000:40_500] = np.nan
    rows = rows_of(values)
    assert len(rows) < 3100
    assert {int(np.nanargmin(values)), int(np.nanargmax(values)), 39_999, 40_000, 40_499, 40_500} <= set(rows.tolist())
    assert np.array_equal(rows_of(values[:6000]), np.arange(6000))


def test_one_sample_and_a_constant_coordinate_are_plotted_too(run: Run, tmp_path: Path) -> None:
    plot(fourbar(np.array([60.0])), tmp_path / "one.png", ["coupler.x"])
    plot(with_gap(run, 0, 180), tmp_path / "none.png", ["coupler.x"])
    panels = _sheet([run], stacks_of(run, ["rocker.x"])).axes
    assert set(panels[0].lines[0].get_ydata()) == {1.0}
    assert set(panels[1].lines[0].get_ydata()) == {0.0}


def test_a_column_that_was_not_kept_is_an_empty_panel_with_a_note(run: Run) -> None:
    panels = _sheet([select(run, ["q"])], stacks_of(select(run, ["q"]), ["coupler.x"])).axes
    assert [[text.get_text() for text in panel.texts] for panel in panels] == [[], ["not kept"], ["not kept"]]


def test_a_plot_of_columns_that_were_not_kept_is_refused(heavy: Run, tmp_path: Path) -> None:
    message = (
        r"the run does not keep O\.force_x, O\.force_y, O\.force, \.\.\.; keep them: --channels all, or their names$"
    )
    with pytest.raises(FigureError, match=message):
        plot(select(heavy, ["-reactions"]), tmp_path / "a.svg", ["reactions"])
    assert not (tmp_path / "a.svg").exists()


def test_what_cannot_be_plotted_is_reported(run: Run, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=r"the run has no coordinate 'cupler\.x'; did you mean 'coupler\.x'\?"):
        plot(run, tmp_path / "run.svg", ["cupler.x"])
    with pytest.raises(
        FigureError, match=r"run\.jpg: '\.jpg' is not a known format of figures; known: \.svg, \.png, \.pdf"
    ):
        plot(run, tmp_path / "run.jpg")
    names = tuple(CoordinateName(f"body{k}", "x") for k in range(31))
    table = np.zeros((181, 31))
    wide = dataclasses.replace(run, outputs=names, coordinate_count=31, values=table, rates=table, accelerations=table)
    with pytest.raises(FigureError, match="31 coordinates are too many for one sheet, which holds 30; choose some"):
        plot(wide, tmp_path / "run.svg", ["q"])
    with pytest.raises(FigureError, match="the run has no samples to plot"):
        plot(fourbar(np.array([])), tmp_path / "run.svg")
    with pytest.raises(FigureError, match="the run has no samples to plot"):
        plot(kinfmu.solve(kinfmu.load("fourbar"), crank_angle=[]), tmp_path / "run.svg")
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def heavy() -> Run:
    return kinfmu.solve(loaded("slider_crank"))


def test_efforts_and_energies_are_panels_with_their_units(heavy: Run) -> None:
    stacks = stacks_of(heavy, ["forces"])
    assert [stack.title for stack in stacks] == ["crank", "crank, continued", "energy"]
    panels = _sheet([heavy], stacks).axes
    assert [panel.get_ylabel() for panel in panels] == [
        "torque [N m]",
        "power [W]",
        "bias_torque [N m]",
        "reduced_inertia\n[kg m²]",
        "kinetic_energy [J]",
        "potential_energy [J]",
    ]
    np.testing.assert_array_equal(panels[0].lines[0].get_ydata(), heavy["crank.torque"])


def test_reactions_are_plotted_if_they_are_named(heavy: Run) -> None:
    columns = [panel.column for stack in stacks_of(heavy, []) for panel in stack.panels]
    assert {"crank.torque", "kinetic_energy", "rod.ax"} <= set(columns)
    assert not set(heavy.reaction_names) & set(columns)
    (pin,) = stacks_of(heavy, ["O.*"])
    assert (pin.title, [panel.column for panel in pin.panels]) == ("O", ["O.force_x", "O.force_y", "O.force"])
    assert [panel.unit for panel in pin.panels] == ["N", "N", "N"]
    without = stacks_of(heavy, ["-forces"])
    assert [stack.title for stack in without] == list(heavy.names)
    with pytest.raises(RequestError, match=r"no coordinate 'O\.forse_x'; did you mean 'O\.force_x'\?"):
        stacks_of(heavy, ["crank.torque", "O.forse_x"])


def test_columns_without_a_joint_or_driver_have_the_title_of_what_they_are() -> None:
    kinds = {"kick_force": "force", "brake_torque": "torque", "shaking_moment": "torque", "kinetic_energy": "energy"}
    titles = [_title_of(ForceName("", noun, Quantity(kind))) for noun, kind in kinds.items()]
    assert titles == ["loads", "loads", "shaking", "energy"]


def test_four_stacks_are_two_rows_of_two(run: Run) -> None:
    made = _sheet([run], stacks_of(run, ["coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]))
    lefts = sorted({round(axes.get_position().x0, 6) for axes in made.axes})
    assert (len(made.axes), len(lefts)) == (12, 2)


def test_reactions_without_values_are_reported() -> None:
    run = kinfmu.solve(loaded("fourbar"), np.arange(5.0))
    (axes,) = _sheet([run], stacks_of(run, ["AB.force"])).axes
    assert [text.get_text() for text in axes.texts] == ["not determined"]


# ----------------------------------------------------------------------------------------------------------- svaj jumps


def cam_run(step: float) -> Run:
    return kinfmu.solve(kinfmu.load("cam_roller"), cam_angle=np.radians(np.arange(0.0, 360.0 + 0.5 * step, step)))


def panels_of(run: Run) -> list[tuple[FloatArray, FloatArray]]:
    """Return x and y of the four curves of the pitch curve's radius."""
    curve = motion_curve(run, "pitch")
    rows = curve.drawn()
    across = driver_axis(run, curve)
    across = replace(across, values=across.values[rows])
    axes = _svaj_sheet(run, across, "pitch", curve.table[rows], ["mm"] * 4, degrees=False).axes
    assert axes[-1].get_xlabel() == "cam [deg]"
    return [one.lines[0].get_data() for one in axes]  # type: ignore[misc]  # arrays


@pytest.mark.parametrize("step", [1.0, 0.7])  # with samples at the breaks, and without
def test_the_jerk_of_a_cam_jumps_upright_where_its_segments_meet(step: float) -> None:
    run = cam_run(step)
    curve = motion_curve(run, "pitch")
    breaks = np.degrees(curve.drive[curve.side < 0, 0])
    x, y = panels_of(run)[3]
    upright = np.flatnonzero((np.diff(x) == 0.0) & (np.abs(np.diff(y)) > 0.1 * np.ptp(y)))
    assert len(breaks) >= 4
    np.testing.assert_allclose(x[upright], breaks, atol=1e-9)
    slanted = (np.diff(x) > 0.0) & (np.abs(np.diff(y)) > 0.2 * np.ptp(y))
    assert not slanted.any()


def test_the_jerk_of_a_cam_from_a_table_has_no_slopes_at_the_ends_of_its_dwells() -> None:
    """Cubic pieces that meet at every second sample: each jump is upright."""
    count = 90
    angle = np.linspace(0.0, 2.0 * math.pi, count + 1)
    lift = 30.0 + 2.0 * np.where(angle < math.pi, 1.0 - np.cos(2.0 * angle), 0.0)
    lift[-1] = lift[0]
    law = kinfmu.mechanism.laws.Spline(tuple(zip(angle, lift, strict=True)), "periodic")
    mechanism = kinfmu.load("cam_roller")
    joints = tuple(replace(j, law=law) if isinstance(j, kinfmu.CamRoller) else j for j in mechanism.joints)
    run = kinfmu.solve(replace(mechanism, joints=joints), cam_angle=np.linspace(0.0, 2.0 * math.pi, 2 * count + 1))
    x, y = panels_of(run)[3]
    slanted = (np.diff(x) > 0.0) & (np.abs(np.diff(y)) > 0.05 * np.ptp(y))
    assert not slanted.any()
    assert np.ptp(y) > 10.0


@pytest.mark.parametrize(("speed", "of_sample"), [(1.0, 1), (-1.0, -1)])
def test_sides_are_in_the_order_of_the_run_whichever_way_the_cam_turns(speed: float, of_sample: int) -> None:
    """A dwell ends where a rise begins; a sample at the break has the jerk of the law's right piece, the rise."""
    angles = speed * np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
    run = kinfmu.solve(followers.lifted_roller(8.0), cam_angle=angles, cam_speed=speed)
    found = {column.name: column.values for column in svaj_columns(run, "lift")}
    at_break = found["cam_angle"] == 0.0
    assert found["side"][at_break].tolist() == [-1, 0, 1]
    before, sample, after = found["jerk"][at_break]
    rise = speed**3 * 15.0 * 4.0 * math.pi**2 / math.radians(120.0) ** 3  # of a cycloid of height 15 over 120 deg
    assert {-1: before, 1: after}[of_sample] == pytest.approx(rise, rel=1e-9)
    assert {-1: before, 1: after}[-of_sample] == pytest.approx(0.0, abs=1e-9)
    assert sample == pytest.approx(rise, rel=1e-9)
