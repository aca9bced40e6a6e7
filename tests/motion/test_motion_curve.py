"""Limits of the jerk at breaks of laws, against closed forms and against samples right next to a break."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.laws import Law
from kinfmu.motion.motion_curve import MotionCurve, motion_curve, motion_of
from tests.mechanisms import slider_crank

LEVER = """
name = "lever"
bodies.ground.points = { O = [0, 0], G = [80, 0] }
bodies.cam.points = { O = [0, 0] }
bodies.lever.points = { G = [0, 0] }
bodies.lever.start = { x = 80 }
units.length = "mm"
joints.O = { type = "revolute", between = ["ground.O", "cam.O"] }
joints.G = { type = "revolute", between = ["ground.G", "lever.G"] }
drivers.cam = { type = "angle", of = "cam", law = "constant_speed", speed = "120 rpm" }
[joints.lift]
type = "cam_oscillating"
between = ["ground", "lever"]
cam = "cam"
law = "sequence"
repeat = true
segments = [
    { law = "modified_sine", duration = "110 deg", rise = "20 deg" },
    { law = "dwell", duration = "60 deg" },
    { law = "modified_sine", duration = "110 deg", rise = "-20 deg" },
    { law = "dwell", duration = "80 deg" },
]
"""
PEAK = 20.0 * 16.0 * math.pi**3 / (4.0 + math.pi) / (110.0 / 720.0) ** 3  # [deg/s3]: 389 604


@pytest.fixture
def lever(tmp_path: Path) -> Mechanism:
    path = tmp_path / "lever.toml"
    path.write_text(LEVER, encoding="utf-8")
    return kinfmu.load(path)


def limits(curve: MotionCurve, order: int = 3) -> dict[tuple[int, int], float]:
    """Return the limits by the driver's value in whole degrees and the side."""
    rows = np.flatnonzero(curve.side)
    degrees = np.degrees(curve.drive[rows, 0])
    np.testing.assert_allclose(degrees, degrees.round(), atol=1e-9)
    keys = zip(degrees.round().astype(int).tolist(), curve.side[rows].tolist(), strict=True)
    return dict(zip(keys, curve.table[rows, order].tolist(), strict=True))


def driver_by(law: Law, mechanism: Mechanism) -> Driver:
    (driver,) = mechanism.drivers
    return replace(driver, law=law)  # type: ignore[type-var]  # the contract; its members are dataclasses


@pytest.mark.parametrize("name", ["lift", "lever.phi"])
@pytest.mark.parametrize("step", [0.002, 0.0011, 0.01])  # with samples at breaks, and without
@pytest.mark.few(3)
def test_the_jerk_at_both_sides_of_a_break_of_a_cam_is_that_of_its_law(
    lever: Mechanism, name: str, step: float
) -> None:
    assert pytest.approx(389604.0, abs=1.0) == PEAK
    curve = motion_curve(kinfmu.solve(lever, np.arange(0.0, 0.7, step)), name)
    found = limits(curve)
    exact = {(110, -1): PEAK, (110, 1): 0.0, (170, -1): 0.0, (170, 1): -PEAK, (280, -1): -PEAK, (280, 1): 0.0}
    exact |= {(360, -1): 0.0, (360, 1): PEAK, (470, -1): PEAK, (470, 1): 0.0}
    assert found.keys() == exact.keys()
    for key, value in exact.items():
        assert math.degrees(found[key]) == pytest.approx(value, rel=1e-11, abs=1e-6)
    assert np.nanmax(np.abs(np.degrees(curve.table[:, 3]))) <= PEAK * (1.0 + 1e-11)
    assert (np.diff(curve.t) >= 0.0).all()


def test_a_curve_against_the_law_has_the_sides_of_its_way(lever: Mechanism) -> None:
    down = np.radians(np.arange(200.0, 59.0, -7.0))
    found = limits(motion_curve(kinfmu.solve(lever, cam_angle=down, cam_speed=-1.0), "lever.phi"))
    peak = math.radians(PEAK) / (4.0 * math.pi) ** 3
    for key, value in {(170, -1): peak, (170, 1): 0.0, (110, -1): 0.0, (110, 1): -peak}.items():
        assert found.pop(key) == pytest.approx(value, rel=1e-11, abs=1e-12)
    assert not found


def test_a_sample_at_a_break_stays_between_its_limits(lever: Mechanism) -> None:
    degrees = np.arange(0.0, 361.0, 10.0)
    run = kinfmu.solve(lever, cam_angle=np.radians(degrees))
    curve = motion_curve(run, "lever.phi")
    at = np.flatnonzero(curve.place == 17.0)
    assert curve.side[at].tolist() == [-1, 0, 1]
    assert curve.table[at[1], 3] == curve.table[at[2], 3] != curve.table[at[0], 3]
    np.testing.assert_array_equal(curve.table[curve.side == 0], motion_of(run, "lever.phi")[0])
    drawn = curve.drawn()
    assert at[1] not in drawn
    assert set(curve.place[drawn]) == set(curve.place)
    assert curve.side[curve.place == 36.0].tolist() == [-1, 0]  # the end of the run


def test_limits_of_a_slider_whose_crank_follows_a_table() -> None:
    """x''' = x_1 phi''' + 3 x_2 phi' phi'' + x_3 phi'^3, x_k: derivatives of x = cos phi + sqrt(9 - sin^2 phi)."""
    times, angles = [0.0, 0.3, 0.5, 0.9, 1.4, 2.0], [0.2, 0.5, 1.1, 1.6, 2.4, 2.7]
    mechanism = slider_crank(1.0, 3.0)
    law = kinfmu.mechanism.laws.Spline(tuple(zip(times, angles, strict=True)), "natural")
    mechanism = replace(mechanism, drivers=(driver_by(law, mechanism),))
    curve = motion_curve(kinfmu.solve(mechanism, np.linspace(0.0, 2.0, 24)), "slider.x")
    pieces = CubicSpline(times, angles, bc_type="natural").c  # (4, pieces), highest power first

    def jerk(phi: float, rates: FloatArray) -> float:
        s, c = math.sin(phi), math.cos(phi)
        w, w1, w2, w3 = 9.0 - s * s, -2.0 * s * c, -2.0 * math.cos(2 * phi), 4.0 * math.sin(2 * phi)
        x1 = -s + 0.5 * w1 / w**0.5
        x2 = -c + 0.5 * w2 / w**0.5 - 0.25 * w1**2 / w**1.5
        x3 = s + 0.5 * w3 / w**0.5 - 0.75 * w1 * w2 / w**1.5 + 0.375 * w1**3 / w**2.5
        return float(x1 * rates[2] + 3.0 * x2 * rates[0] * rates[1] + x3 * rates[0] ** 3)

    for k in (1, 2, 3, 4):
        for side, piece in ((-1, k - 1), (1, k)):
            (row,) = np.flatnonzero((np.abs(curve.t - times[k]) < 1e-9) & (curve.side == side))
            p = np.poly1d(pieces[:, piece])
            s = times[k] - times[piece]
            rates = np.array([p.deriv(order)(s) for order in (1, 2, 3)])
            assert curve.drive[row, 0] == pytest.approx(angles[k], abs=1e-13)
            assert curve.table[row, 3] == pytest.approx(jerk(angles[k], rates), rel=1e-10)
            assert curve.t[row] == pytest.approx(times[k], abs=1e-13)


def has_breaks(mechanism: kinfmu.Mechanism) -> bool:
    laws = [driver.law for driver in mechanism.drivers]
    laws += [law for joint in mechanism.joints if (law := getattr(joint, "law", None)) is not None]
    return any(law.own_breaks(3).at for law in laws)


@pytest.mark.parametrize("name", [name for name in kinfmu.mechanism.gallery.names() if has_breaks(kinfmu.load(name))])
@pytest.mark.few(2)
def test_limits_agree_with_samples_next_to_the_break(name: str) -> None:
    """1e-6 of a step away from the break, the jerk has hardly changed."""
    mechanism = kinfmu.load(name)
    start = mechanism.run.start
    t = np.linspace(start, start + min(mechanism.run.stop - start, 20.0), 150)
    curve = motion_curve(kinfmu.solve(mechanism, t), mechanism.coordinate_names[-1])
    rows = np.flatnonzero(curve.side)
    assert len(rows)
    near = np.sort(curve.t[rows] + 1e-6 * (t[1] - t[0]) * curve.side[rows])
    near, inverse = np.unique(near, return_inverse=True)
    expected = motion_of(kinfmu.solve(mechanism, near), mechanism.coordinate_names[-1])[0][inverse]
    order = np.argsort(curve.t[rows] + 1e-6 * (t[1] - t[0]) * curve.side[rows], kind="stable")
    size = np.nanmax(np.abs(curve.table), axis=0) + 1e-9
    known = np.isfinite(expected[:, 3])
    np.testing.assert_allclose((curve.table[rows][order] / size)[known], (expected / size)[known], atol=1e-4)


def test_limits_do_not_depend_on_the_samples() -> None:
    """The polar angle of a roller is no straight line over the cam's angle, so breaks are found between samples."""
    mechanism = kinfmu.load("cam_roller")
    found = []
    for step in (7.0, 0.3):
        run = kinfmu.solve(mechanism, cam_angle=np.radians(np.arange(0.0, 360.0 + 0.5 * step, step)))
        curve = motion_curve(run, "lever.phi")
        rows = np.flatnonzero(curve.side)
        found.append(np.column_stack([curve.drive[rows], curve.side[rows], curve.table[rows]]))
    assert len(found[0]) == 8
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-11)


def test_coinciding_breaks_of_two_laws_count_once(lever: Mechanism) -> None:
    law = kinfmu.mechanism.laws.MotionSequence(
        (("dwell", 0.1), ("3-4-5", 0.5, math.radians(110.0)), ("dwell", 0.2))  # type: ignore[arg-type]
    )
    lever = replace(lever, drivers=(driver_by(law, lever),))
    curve = motion_curve(kinfmu.solve(lever, np.arange(0.0, 0.75, 0.007)), "lever.phi")
    at = curve.t[curve.side != 0]
    for t in (0.1, 0.6):
        assert int((np.abs(at - t) < 1e-9).sum()) == 2
