"""Jumps of acceleration and jerk are vertical lines at the breaks of the law, whatever the samples are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.svaj import _sheet, driver_axis
from kinfmu.motion.breaks import breaks_of, with_jumps
from kinfmu.motion.jerk import motion_of
from kinfmu.run import FloatArray, Run


def cam_run(step: float) -> Run:
    return kinfmu.solve(kinfmu.load("cam_roller"), cam_angle=np.radians(np.arange(0.0, 360.0 + 0.5 * step, step)))


@pytest.mark.parametrize("step", [1.0, 0.7])  # with samples at the breaks, and without
def test_the_jerk_of_a_cam_jumps_upright_where_its_segments_meet(step: float) -> None:
    run = cam_run(step)
    mechanism = run.mechanism
    assert mechanism is not None
    places = breaks_of(run, mechanism, 3)
    found = np.interp(places, np.arange(len(run)), np.degrees(run["cam.phi"]))
    table, _ = motion_of(run, "pitch")
    panels = _sheet(run, driver_axis(run), "pitch", table, ["mm", "mm", "mm", "mm"], degrees=False).axes
    assert panels[-1].get_xlabel() == "cam [deg]"
    x, y = panels[3].lines[0].get_data()
    upright = np.flatnonzero((np.diff(x) == 0.0) & (np.abs(np.diff(y)) > 0.1 * np.ptp(y)))
    assert len(found) >= 4
    np.testing.assert_allclose(np.sort(x[upright]), np.sort(found), atol=1e-6)
    slanted = (np.diff(x) > 0.0) & (np.abs(np.diff(y)) > 0.2 * np.ptp(y))
    assert not slanted.any()


def test_both_ends_of_a_jump_continue_their_sides() -> None:
    x = np.arange(8.0)

    def curve(at: FloatArray, place: float) -> FloatArray:
        return np.where(at < place, 2.0 * at, 100.0 - at)

    for place in (3.25, 4.0):
        along, values = with_jumps(x, curve(x, place), np.array([place]))
        (k,) = np.flatnonzero(np.diff(along) == 0.0)
        assert (along[k], values[k], values[k + 1]) == pytest.approx((place, 2.0 * place, 100.0 - place))
        assert math.isclose(len(along), len(x) + (2 if place % 1.0 else 1))


def test_breaks_without_samples_of_their_own_are_steps() -> None:
    x, y = np.arange(6.0), np.array([0.0, 1.0, 5.0, 2.0, 7.0, 3.0])
    along, values = with_jumps(x, y, np.array([2.2, 2.6, 3.5]))  # two within one interval, and its neighbour
    upright = np.flatnonzero(np.diff(along) == 0.0)
    assert list(zip(along[upright], values[upright], values[upright + 1], strict=True)) == [
        (pytest.approx(2.4), 5.0, 2.0),
        (3.5, 2.0, 7.0),
    ]
    np.testing.assert_array_equal(values, [0.0, 1.0, 5.0, 5.0, 2.0, 2.0, 2.0, 7.0, 7.0, 3.0])


def test_a_curve_that_ends_at_a_break_ends_with_its_own_side() -> None:
    along, values = with_jumps(np.arange(5.0), np.array([0.0, 1.0, 2.0, 3.0, -50.0]), np.array([4.0]))
    np.testing.assert_allclose(along, np.arange(5.0))
    np.testing.assert_allclose(values, np.arange(5.0))


def test_the_jerk_of_a_cam_from_a_table_has_no_slopes_at_the_ends_of_its_dwells() -> None:
    """Cubic pieces that meet at every second sample: each jump is upright."""
    count = 90
    angle = np.linspace(0.0, 2.0 * math.pi, count + 1)
    lift = 30.0 + 2.0 * np.where(angle < math.pi, 1.0 - np.cos(2.0 * angle), 0.0)
    lift[-1] = lift[0]
    law = kinfmu.laws.Spline(tuple(zip(angle, lift, strict=True)), "periodic")
    mechanism = kinfmu.load("cam_roller")
    joints = [replace(j, law=law) if isinstance(j, kinfmu.CamRoller) else j for j in mechanism.joints]
    run = kinfmu.solve(replace(mechanism, joints=joints), cam_angle=np.linspace(0.0, 2.0 * math.pi, 2 * count + 1))
    table, _ = motion_of(run, "pitch")
    x, y = _sheet(run, driver_axis(run), "pitch", table, ["mm"] * 4, degrees=False).axes[3].lines[0].get_data()
    slanted = (np.diff(x) > 0.0) & (np.abs(np.diff(y)) > 0.05 * np.ptp(y))
    assert not slanted.any()
    assert np.ptp(y) > 10.0
