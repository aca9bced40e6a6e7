"""Jerk against closed forms, differentiated in 30 digits, and where it is refused."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest

import kinfmu
from kinfmu.draw import svaj
from kinfmu.errors import RequestError
from kinfmu.motion.jerk import motion_of
from kinfmu.run.channels import select
from tests.analysis.test_lift_off import sliding
from tests.mechanisms import slider_crank

CAM = """
name = "cam"
bodies.ground.points = { O = [0, 0], G = [0, 0] }
bodies.cam.points = { O = [0, 0] }
bodies.follower = { points = { G = [0, 0] }, start = { y = 2 } }
joints.O = { type = "revolute", between = ["ground.O", "cam.O"] }
joints.guide = { type = "translational", between = ["ground.G", "follower.G"], axis = "90 deg" }
drivers.cam = { type = "angle", of = "cam", law = "constant_speed", speed = 2.0 }
[joints.lift]
type = "cam_translating"
between = ["ground.G", "follower.G"]
axis = "90 deg"
cam = "cam"
offset = 2
law = "sequence"
repeat = true
segments = [
    { law = "cycloidal", duration = "120 deg", rise = 0.5 },
    { law = "dwell", duration = "60 deg" },
    { law = "3-4-5", duration = "180 deg", rise = -0.5 },
]
"""


def test_jerk_of_a_slider_under_a_law_of_time() -> None:
    """x = r cos phi + sqrt(l^2 - r^2 sin^2 phi), phi = 0.3 + t + 0.7 t^2 - 0.2 t^3, differentiated by mpmath."""
    mechanism = slider_crank(1.0, 3.0)
    (driver,) = mechanism.drivers
    law = kinfmu.Polynomial((0.3, 1.0, 0.7, -0.2))
    mechanism = dataclasses.replace(mechanism, drivers=(dataclasses.replace(driver, law=law),))
    t = np.linspace(0.0, 1.5, 7)
    run = kinfmu.solve(mechanism, t)
    table, kind = motion_of(run, "slider.x")

    def x(time: mpmath.mpf) -> mpmath.mpf:
        phi = mpmath.mpf("0.3") + time + mpmath.mpf("0.7") * time**2 - mpmath.mpf("0.2") * time**3
        return mpmath.cos(phi) + mpmath.sqrt(9 - mpmath.sin(phi) ** 2)

    with mpmath.workdps(30):
        exact = [[float(mpmath.diff(x, mpmath.mpf(float(one)), k)) for k in range(4)] for one in t]
    assert kind == "length"
    np.testing.assert_allclose(table, exact, atol=1e-12, rtol=0.0)


def test_jerk_of_a_cam_follower_is_that_of_its_law(tmp_path: Path) -> None:
    path = tmp_path / "cam.toml"
    path.write_text(CAM, encoding="utf-8")
    angle = np.radians(np.arange(0.5, 360.0, 1.0))
    run = kinfmu.solve(kinfmu.load(path), cam_angle=angle)
    table, _ = motion_of(run, "lift")
    rise, beta = angle < math.radians(120.0), math.radians(120.0)
    phase = 2.0 * math.pi * angle / beta
    np.testing.assert_allclose(table[rise, 0], 0.5 * (phase - np.sin(phase))[rise] / (2.0 * math.pi), atol=1e-14)
    cycloid = 0.5 * (2.0 * math.pi) ** 2 / beta**3 * np.cos(phase)
    np.testing.assert_allclose(table[rise, 3], cycloid[rise], atol=1e-12)
    s = (angle - math.pi) / math.pi
    fall = angle > math.pi
    np.testing.assert_allclose(table[fall, 3], (-0.5 / math.pi**3 * (60 - 360 * s + 360 * s**2))[fall], atol=1e-12)
    np.testing.assert_array_equal(motion_of(run, "follower.y")[0][:, 1:], table[:, 1:])
    by_time = motion_of(kinfmu.solve(kinfmu.load(path), angle / 2.0), "lift")[0]
    np.testing.assert_allclose(by_time, table * 2.0 ** np.arange(4.0), atol=1e-11)
    svaj(run, tmp_path / "svaj.svg", "lift", degrees=True)
    text = (tmp_path / "svaj.svg").read_text(encoding="utf-8")
    assert all(f">{label}<" in text for label in ("s [m]", "v [m/rad]", "a [m/rad²]", "j [m/rad³]", "cam [deg]"))


def test_jerk_has_a_gap_at_a_bridge_and_is_refused_if_it_is_not_known() -> None:
    mechanism = kinfmu.load("fourbar")
    degrees = np.arange(0.0, 361.0, 30.0)
    run = kinfmu.solve(mechanism, crank_angle=np.radians(degrees))
    jerk = motion_of(run, "coupler.x")[0][:, 3]
    known = degrees % 180.0 != 0.0
    np.testing.assert_array_equal(np.isfinite(jerk), known)
    np.testing.assert_allclose(jerk[known], np.sin(np.radians(degrees))[known], atol=1e-12)
    other = kinfmu.solve(mechanism, crank_angle=np.radians(degrees), crank_acceleration=1.0)
    with pytest.raises(
        RequestError, match=r"^the jerk is not known: driver 'crank' has accelerations that are not those"
    ):
        motion_of(other, "coupler.x")
    with pytest.raises(
        RequestError, match=r"^'cupler\.x' is neither a coordinate nor a cam; did you mean 'coupler\.x'"
    ):
        motion_of(run, "cupler.x")
    part = kinfmu.solve(mechanism, crank_angle=np.radians(degrees), outputs=["crank.phi"])
    with pytest.raises(RequestError, match=r"^the jerk needs all coordinates, and the run does not hold coupler\.x"):
        motion_of(part, "crank.phi")
    with pytest.raises(kinfmu.KinfmuError, match=r"^the run does not hold 'crank\.omega'"):
        motion_of(select(run, ["q"]), "crank.phi")


@pytest.mark.parametrize("joint", ["roller", "flat"])
def test_jerk_of_followers_on_given_cams(joint: str) -> None:
    """The law's value is the height 0.05 + 0.004 cos theta of the follower."""
    theta = np.linspace(0.1, 6.0, 9)
    table, kind = motion_of(kinfmu.solve(sliding(joint), cam_angle=theta, cam_speed=1.0), "lift")
    exact = [np.cos(theta), -np.sin(theta), -np.cos(theta), np.sin(theta)]
    np.testing.assert_allclose(table, 0.004 * np.array(exact).T + [0.05, 0.0, 0.0, 0.0], atol=1e-14)
    assert kind == "length"
