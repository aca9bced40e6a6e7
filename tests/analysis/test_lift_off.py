"""Followers that leave their cam, and programs of cams."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.fmu.force_variables import variable_description
from kinfmu.mechanism.force_names import reaction_names_of
from kinfmu.mechanism.toml_file import parse
from tests.motion.test_breaks import TEXT, tappet
from tests.reports import unwrapped

# ------------------------------------------------------------------------------------------------------------- lift off
# All followers move by A cos(theta) away from the cam, theta: the cam's angle. So the contact force is
#
#     m (g - A w^2 cos theta)


MASS, GRAVITY, SPEED, AMPLITUDE = 2.0, 9.81, 60.0, 0.004
HEAD = """
name = "tappet"
[units]
length = "m"
[gravity]
x = 0
y = "-9.81 m/s2"
[bodies.cam]
points = { O = [0, 0] }
[drivers.cam]
type = "angle"
of = "cam"
law = "constant_speed"
speed = "60 rad/s"
[joints.O]
type = "revolute"
between = ["ground.O", "cam.O"]
[joints.lift]
law = "harmonic"
frequency = 1
"""
SLIDING = """
[bodies.ground]
points = { O = [0, 0], G = [0, 0] }
[bodies.stem]
mass = "2 kg"
points = { roller = [0, 0] }
start = { x = 0, y = 0.05 }
[joints.guide]
type = "translational"
between = ["ground.G", "stem.roller"]
axis = "90 deg"
"""
COS = 'amplitude = 0.004\nphase = "90 deg"\n'
JOINTS = {
    "up": COS + 'type = "cam_translating"\nbetween = ["ground.O", "stem.roller"]\ncam = "cam"\naxis = "90 deg"\n'
    "offset = 0.05\nroller_radius = 0.01",
    "down": COS.replace("= 0", "= -0")
    + 'type = "cam_translating"\nbetween = ["ground.O", "stem.roller"]\ncam = "cam"\n'
    'axis = "270 deg"\noffset = -0.05\nroller_radius = 0.01',
    "face": COS + 'type = "cam_translating"\nbetween = ["ground.O", "stem.roller"]\ncam = "cam"\naxis = "90 deg"\n'
    'offset = 0.05\nnormal = "90 deg"',
    "roller": 'amplitude = 0.004\ntype = "cam_roller"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05',
    "flat": 'amplitude = 0.004\ntype = "cam_flat_face"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05\n'
    'normal = "90 deg"',
}  # r(angle) and h(angle) = 0.05 + 0.004 sin(90 deg - theta)


def sliding(joint: str) -> kinfmu.Mechanism:
    return parse(HEAD + JOINTS[joint] + SLIDING)


@pytest.mark.parametrize("joint", JOINTS)
def test_contact_force_of_sliding_followers(joint: str) -> None:
    theta = np.linspace(0.1, math.tau, 41)
    run = kinfmu.solve(sliding(joint), cam_angle=theta, cam_speed=SPEED)
    np.testing.assert_allclose(run["stem.y"], 0.05 + AMPLITUDE * np.cos(theta), atol=1e-15)
    exact = MASS * (GRAVITY - AMPLITUDE * SPEED**2 * np.cos(theta))
    sense = -1.0 if joint == "down" else 1.0  # the lift of a cam may go towards it
    np.testing.assert_allclose(sense * run["lift.force"], exact, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.few(2)
def test_check_reports_where_sliding_followers_lift_off(joint: str) -> None:
    report = kinfmu.check(sliding(joint))
    assert report.loading is not None
    (found,) = report.loading.lift_offs
    end = math.acos(GRAVITY / (AMPLITUDE * SPEED**2))
    ((begin, stop),) = found.parts
    assert (math.tau - begin, stop) == pytest.approx((end, end), rel=1e-8)
    assert found.largest == pytest.approx(MASS * (AMPLITUDE * SPEED**2 - GRAVITY), rel=1e-9)
    assert math.remainder(found.at, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert (found.force, found.sense, found.unit) == ("lift.force", -1 if joint == "down" else 1, "N")
    sign = "positive" if joint == "down" else "negative"
    text = (
        f"lift: the follower lifts off: contact force lift.force {sign} from 312.9 deg to 47.06 deg of cam; "
        "largest tension 9.18 N (cam at 0 deg)"
    )
    assert f"poor {text}" in unwrapped(report, detail=False)


@pytest.mark.parametrize("speed", ["60 rad/s", "-60 rad/s"])
def test_a_part_of_lift_off_goes_forwards_whichever_way_the_cam_turns(speed: str) -> None:
    text = (HEAD + JOINTS["up"] + SLIDING).replace('phase = "90', 'phase = "60')
    mechanism = parse(text.replace("60 rad/s", speed))
    report = kinfmu.check(mechanism)
    assert report.loading is not None
    (found,) = report.loading.lift_offs
    ((begin, end),) = found.parts
    inside = begin + (end - begin) % math.tau * np.linspace(0.001, 0.999, 9)
    around = end + (begin - end) % math.tau * np.linspace(0.001, 0.999, 9)
    for angles, pulls in ((inside, True), (around, False)):
        run = kinfmu.solve(mechanism, cam_angle=angles, cam_speed=SPEED)
        assert ((run["lift.force"] < 0.0) == pulls).all()


def test_lift_off_under_a_driver_that_turns_back_is_reported_in_time() -> None:
    text = HEAD.replace(
        'law = "constant_speed"\nspeed = "60 rad/s"', 'law = "harmonic"\namplitude = 1.5\nfrequency = 50'
    )
    mechanism = parse(text + JOINTS["up"] + SLIDING + "[run]\nstop = 0.11\nstep = 0.001")
    report = kinfmu.check(mechanism)
    assert report.loading is not None
    (found,) = report.loading.lift_offs
    assert (found.driver, found.at_unit, found.extent) == ("time", "s", "part")
    t = np.linspace(0.0, 0.11, 1001)
    pulls = kinfmu.solve(mechanism, t)["lift.force"] < 0.0
    is_inside = np.any([(t >= begin) & (t <= end) for begin, end in found.parts], axis=0)
    np.testing.assert_array_equal(pulls, is_inside)
    assert " s of time; largest tension" in unwrapped(report)


LEVER = (
    'type = "cam_oscillating"\nbetween = ["ground", "lever"]\ncam = "cam"\namplitude = {amplitude}\n'
    'phase = "90 deg"\ncontact = "lever.R"\nroller_radius = 0.005\n'
    "[bodies.ground]\npoints = {{ O = [0, 0], G = [{x}, 0.05] }}\n"
    "[bodies.lever]\nmass = 1\ninertia = 0.02\ncenter_of_mass = [0, 0]\n"
    "points = {{ G = [0, 0], R = [{arm}, 0] }}\nstart = {{ x = {x}, y = 0.05, phi = 0 }}\n"
    '[joints.G]\ntype = "revolute"\nbetween = ["ground.G", "lever.G"]\n'
)


@pytest.mark.parametrize(("side", "sense"), [(-1.0, 1), (1.0, -1)])
def test_moment_on_a_lever(side: float, sense: int) -> None:
    """A lever with its centre of mass at the pivot: the moment on it is its inertia times its acceleration.

    With the pivot left of the cam, counter-clockwise is away from the cam; right of it, clockwise.
    """
    amplitude = 0.06 * sense
    mechanism = parse(HEAD + LEVER.format(amplitude=amplitude, x=side * 0.1, arm=-side * 0.1))
    theta = np.linspace(0.1, math.tau, 41)
    run = kinfmu.solve(mechanism, cam_angle=theta, cam_speed=SPEED)
    np.testing.assert_allclose(run["lift.moment"], -0.02 * amplitude * SPEED**2 * np.cos(theta), rtol=1e-11, atol=1e-11)
    report = kinfmu.check(mechanism)
    assert report.loading is not None
    (found,) = report.loading.lift_offs
    assert (found.force, found.sense, found.unit) == ("lift.moment", sense, "N m")
    ((begin, end),) = found.parts
    assert (begin, end) == pytest.approx((1.5 * math.pi, 0.5 * math.pi), rel=1e-8)
    assert found.largest == pytest.approx(0.02 * 0.06 * SPEED**2, rel=1e-9)
    assert found.extent == "part"
    assert "; largest moment that pulls 4.32 N m (cam at 0 deg)" in unwrapped(report)


@pytest.mark.parametrize(
    ("speed", "extent", "where"),
    [
        ('law = "constant_speed"\nspeed = "60 rad/s"', "turn", "at every angle of cam"),
        ('law = "harmonic"\namplitude = 1\nfrequency = 60', "motion", "in the whole motion"),
    ],
)
def test_a_load_on_the_wrong_side_pulls_throughout(speed: str, extent: str, where: str) -> None:
    """A pivot left of the cam, and a torque on the lever that turns it away from the cam."""
    cam = HEAD.replace('law = "constant_speed"\nspeed = "60 rad/s"', speed)
    load = '[loads.spring]\ntype = "torque"\non = "lever"\nlaw = "polynomial"\ncoefficients = ["500 N m"]\n'
    report = kinfmu.check(parse(cam + LEVER.format(amplitude=0.06, x=-0.1, arm=0.1) + load))
    assert report.loading is not None
    (found,) = report.loading.lift_offs
    assert (found.extent, found.as_json()["extent"]) == (extent, extent)
    assert f"contact moment lift.moment negative {where}; largest moment that pulls 5" in unwrapped(report)
    if extent == "turn":
        assert found.largest == pytest.approx(500.0 + 0.02 * 0.06 * SPEED**2, rel=1e-9)


def test_a_pressed_follower_has_no_such_line() -> None:
    report = kinfmu.check(parse((HEAD + JOINTS["up"] + SLIDING).replace("60 rad/s", "40 rad/s")))
    assert report.loading is not None
    assert report.loading.lift_offs == ()
    assert "lifts off" not in unwrapped(report)


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.few(2)
def test_the_variable_of_an_fmu_states_its_sign(joint: str) -> None:
    mechanism = sliding(joint)
    (name,) = (name for name in reaction_names_of(mechanism) if name.owner == "lift")
    text = variable_description(kinfmu.check(mechanism).plan, name)
    assert text.startswith("Joint lift: force of the cam on its follower, ")
    assert "positive where pressed" in text


# ---------------------------------------------------------------------------------------------------------- cam program


GIVEN = {
    "cam_roller": 'type = "cam_roller"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05',
    "cam_flat_face": 'type = "cam_flat_face"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05\nnormal = "90 deg"',
}


def test_the_parts_of_a_lift_are_those_of_its_law() -> None:
    report = kinfmu.check(tappet("cycloidal", "40 deg"))
    parts = "rise 40 deg to 110 deg, dwell 110 deg to 170 deg, return 170 deg to 280 deg, dwell 280 deg to 40 deg"
    assert f"program of lift over cam: {parts}" in unwrapped(report)
    (cam,) = report.cams
    assert [part["part"] for part in cam.as_json()["program"]] == ["rise", "dwell", "return", "dwell"]
    at_start = kinfmu.check(tappet("cycloidal", "0 deg"))
    parts = "rise 0 deg to 70 deg, dwell 70 deg to 130 deg, return 130 deg to 240 deg, dwell 240 deg to 360 deg"
    assert parts in unwrapped(at_start)


@pytest.mark.parametrize("joint", GIVEN)
def test_the_parts_of_given_cams_are_those_of_the_motion(joint: str) -> None:
    """The law is over the angle in the cam, which goes backwards while the cam turns: the motion shows its parts."""
    old = TEXT[TEXT.index('type = "cam_translating"') : TEXT.index('law = "sequence"')]
    text = TEXT.replace(old, GIVEN[joint] + "\n").replace("LAW", "cycloidal").replace("BEGIN", "10 deg")
    mechanism = parse(text)
    (cam,) = kinfmu.check(mechanism).cams
    assert [part for part, _, _ in cam.program].count("dwell") == 2
    assert {part for part, _, _ in cam.program} == {"rise", "dwell", "return"}
    for (_, _, end), (_, begin, _) in pairwise(cam.program):
        assert end == pytest.approx(begin, abs=1e-9)
    for part, begin, end in cam.program:
        width = (end - begin) % math.tau
        inside = begin + width * np.linspace(0.01, 0.99, 9)
        speed = kinfmu.solve(mechanism, cam_angle=inside)["stem.vy"]
        assert {"rise": (speed > 0.0).all(), "return": (speed < 0.0).all(), "dwell": (speed == 0.0).all()}[part]


def test_a_cam_that_cannot_be_made_has_matrices_and_assemblies(tmp_path: Path) -> None:
    """A roller that reaches the axle is a problem of the profile, not of the motion."""
    text = TEXT.replace("LAW", "cycloidal").replace("BEGIN", "0 deg")
    path = tmp_path / "cut.toml"
    path.write_text(text.replace("offset = 0.05", "offset = 0.05\nroller_radius = 0.06"), encoding="utf-8")
    plain, matrices, assemblies = (
        CliRunner().invoke(main, ["check", str(path), *more]) for more in ([], ["--matrices"], ["--assemblies"])
    )
    for result in (plain, matrices, assemblies):
        assert result.exit_code == 1
        assert "the roller of radius 0.06 m reaches the cam's axle" in result.stderr
    assert "row-reduced" in matrices.stdout
    assert len(assemblies.stdout) > len(plain.stdout)
