"""Plots of columns over any other column, overlays, polar plots, two runs: values, scales, units, messages."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import kinfmu
from kinfmu.draw import plot
from kinfmu.draw.overlay import overlay, overlay_sheet
from kinfmu.draw.plots import _sheet, stacks_of
from kinfmu.errors import FigureError, KinfmuError, RequestError
from kinfmu.run import Run
from kinfmu.units import CoordinateName
from tests.log.runs import fourbar, with_gap


@pytest.fixture
def run() -> Run:
    return fourbar(np.arange(361.0))


def sheet(runs: list[Run], columns: list[str], xs: list[str], *, degrees: bool = False, polar: bool = False) -> Figure:
    return overlay_sheet(overlay(runs, ("a", "b"), columns, xs, degrees=degrees, polar=polar))


def test_a_coupler_curve_is_a_circle_with_equal_scales(run: Run) -> None:
    made = sheet([run], ["coupler.y"], ["coupler.x"])
    (axes,) = made.axes
    made.draw_without_rendering()
    x, y = axes.lines[0].get_xydata().T
    np.testing.assert_allclose((x - 1.0) ** 2 + y**2, 1.0, rtol=1e-14)
    (x0, y0), (x1, y1) = axes.transData.transform([[0.0, 0.0], [1.0, 1.0]])
    assert x1 - x0 == pytest.approx(y1 - y0)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("coupler.x [m]", "coupler.y [m]")


def test_forces_over_forces_and_rates_over_rates_have_equal_scales_and_other_columns_have_not() -> None:
    run = kinfmu.solve(kinfmu.load("engine"), np.linspace(0.0, 0.04, 73))

    def scales(x: str, *columns: str) -> list[tuple[float, float]]:
        made = sheet([run], [*columns], [x])
        made.draw_without_rendering()
        found = []
        for axes in made.axes:
            (x0, y0), (x1, y1) = axes.transData.transform([[0.0, 0.0], [1.0, 1.0]])
            found.append((x1 - x0, y1 - y0))
        return found

    for x, y in [("O.force_x", "O.force_y"), ("rod.vx", "rod.vy"), ("rod.ax", "rod.ay")]:
        ((across, up),) = scales(x, y)
        assert across == pytest.approx(up), x
    for x, y in [
        ("crank.torque", "crank.power"),
        ("rod.x", "rod.vx"),
        ("crank.phi", "rod.phi"),
        ("rod.vy", "O.force_y"),
    ]:
        ((across, up),) = scales(x, y)
        assert across != pytest.approx(up), x
    forces, torque = scales("O.force_x", "P.force_x", "crank.torque")  # a panel for each unit
    assert forces[0] == pytest.approx(forces[1])
    assert torque[0] != pytest.approx(torque[1])


def test_a_flat_path_has_a_flat_sheet(run: Run) -> None:
    narrow = dataclasses.replace(run, values=run.values * np.where(np.array(run.outputs) == "coupler.y", 0.5, 1.0))
    round_, flat = (sheet([one], ["coupler.y"], ["coupler.x"]) for one in (run, narrow))
    boxes = [axes.get_window_extent() for axes in (round_.axes[0], flat.axes[0])]
    assert boxes[0].height == pytest.approx(boxes[0].width)
    assert boxes[1].height == pytest.approx(0.5 * boxes[1].width)
    assert round_.get_figheight() - flat.get_figheight() == pytest.approx(330.0 / 2.0 / 72.0)


def test_each_curve_may_have_its_own_x(run: Run) -> None:
    (axes,) = sheet([run], ["coupler.y", "A.y"], ["coupler.x", "A.x"]).axes
    for line, centre in zip(axes.lines, (1.0, 2.0), strict=True):
        x, y = line.get_xydata().T
        np.testing.assert_allclose((x - centre) ** 2 + y**2, 1.0, rtol=1e-13)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "[m]")
    with pytest.raises(FigureError, match=r"^x names 2 columns for 1 curves; name one for all curves, or one for each"):
        sheet([run], ["A.y"], ["coupler.x", "A.x"])


def test_columns_of_one_unit_share_a_panel_over_an_angle_in_degrees(run: Run) -> None:
    angles, lengths = sheet([run], ["rocker.phi", "A.x", "coupler.phi"], ["crank.phi"], degrees=True).axes
    np.testing.assert_allclose(angles.lines[0].get_xydata(), np.column_stack([run.t, run.t]), atol=1e-12)
    assert [text.get_text() for text in angles.get_legend().get_texts()] == ["rocker.φ", "coupler.φ"]
    assert (angles.get_ylabel(), lengths.get_ylabel()) == ("[deg]", "A.x [m]")
    assert lengths.get_xlabel() == "crank.φ [deg]"
    assert set(np.diff(lengths.get_xticks())) == {45.0}


def test_a_polar_plot_has_the_driver_as_its_angle(run: Run) -> None:
    (axes,) = sheet([run], ["A.y", "coupler.x"], ["crank.phi"], polar=True).axes
    np.testing.assert_allclose(axes.lines[0].get_xydata(), np.column_stack([run["crank.phi"], run["A.y"]]), atol=1e-12)
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == [
        "A.y [m]",
        f"coupler.x [m] (grey circle: 0; centre: {axes.get_rmin():.3g})".replace("-", "\N{MINUS SIGN}"),
    ]
    assert axes.get_rmin() < -1.2  # the least value is -1
    zero = axes.lines[-1].get_ydata()
    assert not zero.any()
    curve = np.concatenate([run[name] for name in ("A.y", "coupler.x")]) - axes.get_rmin()
    curve = curve * np.exp(1j * np.tile(run["crank.phi"], 2))
    numbers = (axes.get_yticks() - axes.get_rmin()) * np.exp(1j * np.radians(axes.get_rlabel_position()))
    assert np.abs(numbers[:, None] - curve).min() > 0.1  # of a radius of about 3
    (by_default,) = sheet([run], ["A.y", "coupler.x"], [], polar=True).axes
    np.testing.assert_allclose(by_default.lines[0].get_xydata(), axes.lines[0].get_xydata(), atol=1e-12)


def test_a_polar_plot_without_a_single_driver_of_an_angle_needs_an_angle() -> None:
    run = kinfmu.solve(kinfmu.load("five_bar"))
    with pytest.raises(
        FigureError, match=r"^a polar plot needs an angle, not t \[s\]; name one by x \(--x\), such as "
    ):
        sheet([run], ["left_arm.phi"], [], polar=True)


def test_a_sheet_with_too_many_curves_names_what_to_leave_out(run: Run) -> None:
    names = tuple(CoordinateName(f"body{k}", "x") for k in range(20))
    table = np.zeros((len(run), 20))
    wide = dataclasses.replace(run, outputs=names, coordinate_count=20, values=table, rates=table, accelerations=table)
    message = (
        r"^the panel \[m\] would have 20 curves and holds 18: leave out at least 2 of them, by a minus .* -body19\.x$"
    )
    with pytest.raises(FigureError, match=message):
        sheet([wide], list(map(str, names)), [])
    assert sheet([wide], [*map(str, names), "-body19.x", "-body18.x"], []).axes


def test_two_runs_share_a_plot_the_first_one_wide(run: Run) -> None:
    other = run.part(slice(0, 90))
    (axes,) = sheet([run, other], ["coupler.y"], []).axes
    stacked = _sheet([run, other], stacks_of(run, ["coupler.y"]), ("long", "short"))
    for lines in (axes.lines, stacked.axes[0].lines):
        assert [len(line.get_xydata()) for line in lines] == [361, 90]
        assert lines[0].get_linewidth() > 2.0 * lines[1].get_linewidth()
    assert stacked.texts[0].get_text().endswith("long (wide), short (narrow)")


def test_two_runs_that_do_not_fit_are_refused(run: Run, tmp_path: Path) -> None:
    inches = dataclasses.replace(run, length_unit="in")
    with pytest.raises(FigureError, match=r"^the runs measure lengths in m and in; they need the same unit"):
        plot(run, tmp_path / "a.svg", other=inches)
    driven = dataclasses.replace(run, axis="crank_angle")
    with pytest.raises(FigureError, match=r"^the runs are over t \[s\] and crank \[deg\], with rates per time and per"):
        plot(run, tmp_path / "a.svg", other=driven)


def test_inputs_and_diagnostics_are_columns_too(run: Run) -> None:
    stacks = stacks_of(run, ["crank_*", "solver.m*", "watch.AB"])
    assert [(stack.title, [panel.label for panel in stack.panels]) for stack in stacks] == [
        ("crank", ["angle", "speed", "acceleration"]),
        ("solver", ["margin"]),
        ("watch", ["AB"]),
    ]
    panels = _sheet([run], stacks, degrees=True).axes
    np.testing.assert_allclose(panels[0].lines[0].get_ydata(), run.t, atol=1e-12)
    assert [panel.get_ylabel() for panel in panels[:3]] == ["angle [deg]", "speed [deg/s]", "acceleration\n[deg/s²]"]
    assert [panel.get_yscale() for panel in panels] == ["linear", "linear", "linear", "log", "log"]
    status = with_gap(run, 100, 120)
    (axes,) = sheet([status], ["solver.status"], []).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), status.status)  # also where there are no values


def test_a_column_over_another_in_given_axes(run: Run) -> None:
    axes = Figure().subplots()
    plot(run, ax=axes, columns=["rocker.phi"], x="crank.phi", degrees=True)
    np.testing.assert_allclose(axes.lines[0].get_xydata(), np.column_stack([run.t, run.t]), atol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("crank.phi [deg]", "rocker.phi [deg]")
    with pytest.raises(FigureError, match=r"^overlaid, polar, other, certificate and several x are for files; call plot again"):
        plot(run, ax=axes, columns=["rocker.phi"], polar=True)  # type: ignore[call-overload]


def test_what_an_overlay_cannot_show_is_reported(run: Run, tmp_path: Path) -> None:
    def message(kind: type[KinfmuError], columns: list[str], x: str) -> str:
        with pytest.raises(kind) as caught:
            plot(run, tmp_path / "a.svg", columns, x=x)
        return str(caught.value)

    assert message(KinfmuError, ["coupler.y"], "cupler.x").startswith("the run has no column 'cupler.x'; did you mean")
    assert message(RequestError, ["cupler.y"], "crank.phi").startswith("channel 'cupler.y' is not known; did you mean")
    part = kinfmu.run.channels.select(run, ["coupler.y"])
    with pytest.raises(
        KinfmuError, match=r"^the run does not hold 'crank\.phi': it was not among the channels to keep"
    ):
        plot(part, tmp_path / "a.svg", ["coupler.y"], x="crank.phi")
    with pytest.raises(FigureError, match=r"^the run has no samples to plot"):
        plot(run.part(slice(0, 0)), tmp_path / "a.svg", overlaid=True)
    assert not list(tmp_path.iterdir())
