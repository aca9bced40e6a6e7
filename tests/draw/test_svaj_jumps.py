"""Jumps of acceleration and jerk are vertical lines at the breaks of the law, whatever the samples are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw.svaj import _sheet, driver_axis
from kinfmu.motion.motion_curve import motion_curve, svaj_columns
from kinfmu.run import Run
from tests.motion.cams import followers


def cam_run(step: float) -> Run:
    return kinfmu.solve(kinfmu.load("cam_roller"), cam_angle=np.radians(np.arange(0.0, 360.0 + 0.5 * step, step)))


def panels_of(run: Run) -> list[tuple[FloatArray, FloatArray]]:
    """Return x and y of the four curves of the pitch curve's radius."""
    curve = motion_curve(run, "pitch")
    rows = curve.drawn()
    across = driver_axis(run, curve)
    across = replace(across, values=across.values[rows])
    axes = _sheet(run, across, "pitch", curve.table[rows], ["mm"] * 4, degrees=False).axes
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
