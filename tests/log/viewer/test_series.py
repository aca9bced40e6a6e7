"""Curves grouped by unit, and axes that do not mislead."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.scene import palette
from kinfmu.log.viewer.blueprint import plot
from kinfmu.log.viewer.series import SMALLEST, accuracy, efforts, error_estimates, groups, margin
from kinfmu.log.viewer.timeline import timeline_of
from kinfmu.run import Run
from tests.log.runs import fourbar, with_gap
from tests.run.test_forces import loaded


def test_curves_are_grouped_by_unit(run: Run) -> None:
    found = groups(run)
    assert [group.title for group in found.values()] == [
        "angle [rad]",
        "angular velocity [rad/s]",
        "angular acceleration [rad/s2]",
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


def test_every_one_of_many_curves_has_a_name_in_the_legend_and_a_colour_of_its_own() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar_chain:9"), [0.0, 1.0])
    for group in groups(run).values():
        assert len(group.names) > 14
        assert len({*group.names}) == len({*group.colours}) == len(group.names)
        (is_shown,) = (
            plot(group.title, [("", group)], timeline_of([run]), [run])
            .properties["PlotLegend"]
            .visible.as_arrow_array()
        )
        assert is_shown.as_py()


def test_a_single_curve_is_named_by_its_plot(run: Run) -> None:
    (is_shown,) = (
        plot("margin", [("", margin(run))], timeline_of([run]), [run]).properties["PlotLegend"].visible.as_arrow_array()
    )
    assert not is_shown.as_py()


def test_a_gap_is_not_a_number_even_if_the_run_holds_some(run: Run) -> None:
    lost = dataclasses.replace(run, status=np.where(run.t == 7.0, 3, run.status))
    assert np.isnan(groups(lost)["position", "angle"].values[7]).all()


def test_round_off_is_drawn_as_a_line_at_zero(run: Run) -> None:
    noise = np.random.default_rng(1).normal(scale=1e-17, size=run.accelerations.shape)
    found = groups(dataclasses.replace(run, accelerations=run.accelerations + noise))
    usual = np.pi / 180.0**2  # the largest angle over the square of the run's time
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
