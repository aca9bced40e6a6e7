"""Profiles of cams: they touch the follower where the mechanism has it, and agree with the formulas of textbooks.

References: R. L. Norton, Design of Machinery, chapter 8 (pressure angle, radius of curvature, flat faces); the formulas
are evaluated here in 50 digits, derivatives by power series.
"""

from __future__ import annotations

import dataclasses
import math
import re
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.mechanism.joints import CamOscillating
from kinfmu.mechanism.laws import Harmonic, Law, Spline
from kinfmu.mechanism.measures import PressureAngle
from kinfmu.motion.cams import PlacedCam, critical
from kinfmu.motion.cams.traced import Traced
from kinfmu.page.describe import describe
from tests.motion.cams import followers
from tests.oracle import Series, cos, mp, sin
from tests.reports import unwrapped

ANGLES = np.radians(np.arange(0.0, 360.0, 0.5))
TURN = 2.0 * math.pi


def complexes(points: Any) -> Any:
    return points[:, 0] + 1j * points[:, 1]


@pytest.mark.parametrize("kind", followers.ALL)
@pytest.mark.few(2)
def test_the_profile_touches_the_follower_of_the_solved_mechanism_and_nowhere_cuts_it(kind: str) -> None:
    mechanism = followers.ALL[kind]()
    profile = kinfmu.cam_profile(mechanism, "lift", ANGLES)
    some = slice(None, None, 30)
    run = kinfmu.solve(dataclasses.replace(mechanism, coordinates="all"), cam_angle=ANGLES[some])
    assert run.good.all()
    column = {name: run[name] for name in run.names}
    point = dict(mechanism.body_points)["follower.F"]
    follower = np.exp(1j * column["follower.phi"])
    place = column["follower.x"] + 1j * column["follower.y"] + complex(*point) * follower
    for k, angle in enumerate(ANGLES[some]):
        turned = column["cam.x"][k] + 1j * column["cam.y"][k] + complexes(profile.profile) * np.exp(1j * angle)
        if profile.pitch is None:
            gaps = -((turned - place[k]) * np.conj(np.exp(1j * followers.UP) * follower[k])).real
        else:
            gaps = np.abs(turned - place[k]) - profile.roller_radius
        here = 30 * k
        assert abs(gaps[here]) < 1e-12 * 60.0
        assert gaps.min() > -1e-12 * 60.0
        if kind != "knife edge":  # its contact is a corner
            assert int(np.argmin(gaps)) in {here, (here + 1) % 720, here - 1} or gaps.min() > -1e-12


def cycloid(x: Series) -> Series:
    return x - sin(2 * mp.pi * x) / (2 * mp.pi)


def three_four_five(x: Series) -> Series:
    return x * x * x * (10 - 15 * x + 6 * x * x)


def lift_series(angle: float, height: int, shape: Any) -> Series:
    """The lift as a power series of the cam's angle, to the fourth power."""
    theta = Series([angle, 1, 0, 0, 0])
    part = 2 * mp.pi / 3
    if theta.c[0] < part:
        return height * shape(theta / part)
    if theta.c[0] < mp.pi:
        return theta * 0 + height
    if theta.c[0] < mp.pi + part:
        return height - height * shape((theta - mp.pi) / part)
    return theta * 0


def terms(series: Series) -> tuple[Any, Any, Any]:
    return series.c[0], series.c[1], 2 * series.c[2]


@pytest.mark.parametrize(("law", "shape"), [("cycloidal", cycloid), ("3-4-5", three_four_five)])
def test_a_translating_roller_has_the_textbooks_pressure_angle_and_curvature(law: str, shape: Any) -> None:
    """tan alpha = (v - e) / (s + d); curvature of x = e cos + (s + d) sin, y = (s + d) cos - e sin."""
    mechanism = followers.lifted_roller(8.0, followers.rise_and_return(15.0, law))
    angles = np.linspace(0.01, 6.2, 41)
    profile = kinfmu.cam_profile(mechanism, "lift", angles)
    for k, angle in enumerate(angles):
        lift = lift_series(float(angle), 15, shape)
        s, v, _ = terms(lift)
        assert profile.pressure_angle[k] == pytest.approx(float(mp.atan((v - 6) / (s + 32))), abs=1e-14)
        theta = Series([float(angle), 1, 0, 0, 0])
        x, y = 6 * cos(theta) + (lift + 32) * sin(theta), (lift + 32) * cos(theta) - 6 * sin(theta)
        (px, vx, ax), (py, vy, ay) = terms(x), terms(y)
        speed = mp.sqrt(vx * vx + vy * vy)
        radius = -(speed**3) / (vx * ay - vy * ax) - 8  # clockwise in the cam
        assert profile.radius[k] == pytest.approx(float(radius), rel=1e-12)
        outward = (-vy / speed, vx / speed)
        exact = [float(px - 8 * outward[0]) + followers.AXLE[0], float(py - 8 * outward[1]) + followers.AXLE[1]]
        np.testing.assert_allclose(profile.profile[k], exact, atol=1e-13 * 50)


@pytest.mark.parametrize(("law", "shape"), [("cycloidal", cycloid), ("3-4-5", three_four_five)])
def test_a_flat_face_has_the_textbooks_curvature_and_contact(law: str, shape: Any) -> None:
    """rho = R + s + a, contact at v along the face; the face is as wide as the velocities reach."""
    mechanism = followers.lifted_face(followers.rise_and_return(10.0, law))
    angles = np.linspace(0.01, 6.2, 41)
    profile = kinfmu.cam_profile(mechanism, "lift", angles)
    for k, angle in enumerate(angles):
        s, v, a = terms(lift_series(float(angle), 10, shape))
        assert profile.radius[k] == pytest.approx(float(25 + s + a), rel=1e-13)
        assert profile.offset[k] == pytest.approx(float(6 - v), abs=1e-12)
        place = complex(float(v), float(25 + s)) * np.exp(-1j * angle) + complex(*followers.AXLE)
        assert complexes(profile.profile)[k] == pytest.approx(place, abs=1e-12)
    np.testing.assert_allclose(profile.pressure_angle, 0.0, atol=1e-15)


def test_a_harmonic_lift_of_a_flat_face_is_an_eccentric_disc() -> None:
    mechanism = followers.lifted_face(kinfmu.Harmonic(5.0, 1.0), offset=20.0)
    profile = kinfmu.cam_profile(mechanism, "lift", ANGLES)
    centre = complexes(profile.profile).mean()
    np.testing.assert_allclose(np.abs(complexes(profile.profile) - centre), 20.0, rtol=1e-13)
    np.testing.assert_allclose(profile.radius, 20.0, rtol=1e-13)
    assert abs(centre - complex(*followers.AXLE)) == pytest.approx(5.0, rel=1e-13)


def test_an_eccentric_disc_under_a_roller_has_its_exact_pressure_angle_and_curvature() -> None:
    """Pitch circle of radius 40 about a point 6 from the axle, roller 8, follower in line: sin alpha = 6 cos / 40."""
    disc = kinfmu.Body("cam", {"O": (0, 0), "M": (6, 0)})
    follower = kinfmu.Body("follower", {"F": (0, 0)}, (0, 40, 0))
    mechanism = kinfmu.Mechanism(
        "disc",
        [kinfmu.Body("ground", {"O": (0, 0)}), disc, follower],
        [
            kinfmu.Revolute("O", ("ground.O", "cam.O")),
            kinfmu.Translational("guide", ("ground.O", "follower.F"), followers.UP),
            kinfmu.CamRoller("lift", ("cam.M", "follower.F"), kinfmu.Polynomial((40.0,)), 8.0),
        ],
        [kinfmu.AngleDriver("cam", "cam")],
    )
    profile = kinfmu.cam_profile(mechanism, "lift", ANGLES)
    np.testing.assert_allclose(profile.radius, 32.0, rtol=1e-12)
    np.testing.assert_allclose(np.abs(complexes(profile.profile) - 6.0), 32.0, rtol=1e-12)
    np.testing.assert_allclose(np.sin(profile.pressure_angle), 6.0 * np.cos(ANGLES) / 40.0, atol=1e-12)
    np.testing.assert_allclose(
        profile.position, 6.0 * np.sin(ANGLES) + np.sqrt(1600.0 - 36.0 * np.cos(ANGLES) ** 2), rtol=1e-12
    )
    (found,) = kinfmu.check(mechanism).cams
    assert found.critical is not None
    assert [one.value for one in found.critical.pressure] == pytest.approx(
        [-math.asin(0.15), math.asin(0.15)], abs=1e-12
    )


def test_a_flat_face_follows_a_profile_given_by_its_tangents() -> None:
    """A disc of radius 30 with its centre 5 from the pole lifts the face by 5 sin."""
    joint = kinfmu.CamFlatFace(
        "lift", ("cam.O", "follower.F"), kinfmu.Harmonic(5.0, 1.0, 30.0, math.pi / 2.0), followers.UP
    )
    run = kinfmu.solve(followers.sliding(joint), cam_angle=ANGLES)
    np.testing.assert_allclose(run["follower.y"], 30.0 + 5.0 * np.sin(ANGLES), rtol=1e-15)
    np.testing.assert_allclose(run["follower.vy"], 5.0 * np.cos(ANGLES), atol=1e-14)
    np.testing.assert_allclose(run["follower.ay"], -5.0 * np.sin(ANGLES), atol=1e-14)


def test_the_radius_of_curvature_of_a_swinging_follower_is_that_of_its_profile() -> None:
    """From the profile alone: of circles through three points, whose error falls with the square of their distance."""
    for mechanism in (followers.swung_face(), followers.swung_roller(), followers.on_pitch_curve(swings=True)):
        step = 1e-4
        middle = np.linspace(0.2, 6.0, 25)
        around = [complexes(kinfmu.cam_profile(mechanism, "lift", middle + k * step).profile) for k in (-1, 0, 1)]
        a, b, c = around
        area = ((b - a).conj() * (c - b)).imag / 2.0
        radius = -np.abs(b - a) * np.abs(c - b) * np.abs(c - a) / (4.0 * area)
        np.testing.assert_allclose(kinfmu.cam_profile(mechanism, "lift", middle).radius, radius, rtol=2e-3)


def test_pressure_angles_are_those_of_the_measure() -> None:
    """Against the measure `pressure_angle`, which reads the motion."""
    for mechanism, pivot in (
        (followers.lifted_roller(8.0), None),
        (followers.on_pitch_curve(swings=True), "follower.C"),
    ):
        reading = PressureAngle("steep", "cam", "follower.F", pivot, followers.UP)
        measured = dataclasses.replace(mechanism, measures=(reading,))
        run = kinfmu.solve(dataclasses.replace(measured, coordinates="all"), cam_angle=np.linspace(0.0, TURN, 721))
        (found,) = kinfmu.check(mechanism).cams
        assert found.steepest is not None
        assert abs(found.steepest.value) == pytest.approx(abs(kinfmu.measure(run)["steep"].value), rel=1e-9)


def test_values_are_critical_where_they_are_reported() -> None:
    (cam,) = kinfmu.check(followers.lifted_roller(8.0)).cams
    assert cam.critical is not None
    assert cam.critical.convex is not None
    dense = kinfmu.cam_profile(followers.lifted_roller(8.0), "lift", np.linspace(0.0, TURN, 36001))
    assert cam.critical.pressure[0].value == pytest.approx(dense.pressure_angle.min(), abs=1e-8)
    assert cam.critical.pressure[1].value == pytest.approx(dense.pressure_angle.max(), abs=1e-8)
    k = int(np.argmin(np.where(dense.radius > 0.0, dense.radius, np.inf)))
    assert cam.critical.convex.value == pytest.approx(dense.radius[k], abs=1e-6)
    assert cam.critical.convex.at == pytest.approx(dense.angle[k], abs=3e-4)


def geared(plain: kinfmu.Mechanism, ratio: float) -> kinfmu.Mechanism:
    """Return the mechanism with a motor: the cam turns by `ratio` times its angle."""
    ground, cam, follower = plain.bodies
    gear = kinfmu.Coupling(
        "gear", kinfmu.AngleBetween("motor"), kinfmu.AngleBetween("cam"), kinfmu.ConstantSpeed(0.0, ratio)
    )
    return kinfmu.Mechanism(
        "geared",
        [
            kinfmu.Body("ground", {**ground.points, "M": (-90.0, 0.0)}),
            cam,
            follower,
            kinfmu.Body("motor", {"M": (0, 0)}),
        ],
        [*plain.joints, kinfmu.Revolute("M", ("ground.M", "motor.M")), gear],
        [kinfmu.AngleDriver("motor", "motor")],
        length_unit="mm",
    )


def test_a_geared_cam_is_reported_at_the_angle_of_the_driver() -> None:
    """The driver makes two turns for one of the cam, the other way."""
    plain = followers.lifted_roller(8.0)
    mechanism = geared(plain, -0.5)
    (direct,), (found,) = kinfmu.check(plain).cams, kinfmu.check(mechanism).cams
    assert direct.steepest is not None
    assert found.steepest is not None
    assert found.steepest.value == pytest.approx(direct.steepest.value, abs=1e-9)
    assert found.driver == "motor"
    assert found.at(1.0) == pytest.approx((-2.0) % (2.0 * TURN), abs=1e-9)
    profile = kinfmu.cam_profile(mechanism, "lift", np.array([0.5, 1.0]))
    assert profile.driver == pytest.approx([(-1.0) % (2.0 * TURN), (-2.0) % (2.0 * TURN)], abs=1e-9)
    assert [name for name, _, _ in profile.columns()][:2] == ["cam_angle", "motor_angle"]


@pytest.mark.parametrize("ratio", [1.0, -1.0, 2.0, -3.0, 0.5, -0.5, 1.5])
@pytest.mark.few(2)
def test_parts_of_a_geared_cam_go_forwards_over_the_whole_period_of_the_driver(ratio: float) -> None:
    plain = followers.lifted_roller(31.0)
    (direct,), (found,) = kinfmu.check(plain).cams, kinfmu.check(mechanism := geared(plain, ratio)).cams
    turns = next(turns for turns in (1, 2) if (ratio * turns).is_integer())  # of the motor in a period
    assert len(found.undercut) == abs(ratio) * turns * len(direct.undercut)
    ((low, high),) = direct.undercut
    period = turns * TURN
    for begin, end in found.undercut:
        assert (end - begin) % period == pytest.approx((high - low) / abs(ratio), abs=1e-8)
        inside = begin + (end - begin) % period * np.linspace(0.001, 0.999, 9)
        assert ((ratio * inside % TURN > low) & (ratio * inside % TURN < high)).all()
    assert unwrapped(kinfmu.check(mechanism)).count("motor at") >= len(found.undercut)
    program = found.program
    assert len(program) == abs(ratio) * turns * len(direct.program)
    assert (program[0][1], program[-1][2]) == (0.0, pytest.approx(period))
    for (_, _, end), (_, begin, _) in pairwise(program):
        assert end == pytest.approx(begin, abs=1e-8)
    for part, begin, end in program:
        run = kinfmu.solve(mechanism, motor_angle=np.linspace(begin, end, 11)[1:-1])
        speed = run["follower.vy"]
        assert {"rise": (speed > 0.0).all(), "return": (speed < 0.0).all(), "dwell": (speed == 0.0).all()}[part]


WRONG: dict[str, tuple[Any, str]] = {
    "unknown roller": (
        lambda: followers.lifted_roller(None),
        r"cam 'lift' has no profile: \[joints\.lift\] needs the key 'roller_radius', or 'normal' for a flat face",
    ),
    "undercut roller": (
        lambda: followers.lifted_roller(31.0),
        r"\[joints\.lift\] roller_radius = 31 mm must be smaller than the smallest radius of curvature of the pitch "
        r"curve, 30\.5517 mm \(cam at 83\.8\d* deg\), or the base circle larger: the profile is undercut from cam at "
        r"7\d\.\d* deg to 9\d\.\d* deg",
    ),
    "roller on the axle": (
        lambda: followers.lifted_roller(33.0),
        r"\[joints\.lift\] the roller of radius 33 mm reaches the cam's axle: its centre is 32\.5576 mm from it",
    ),
    "undercut face": (
        lambda: followers.lifted_face(offset=3.0),
        r"\[joints\.lift\] a flat face cannot touch a concave profile, radius of curvature -0\.917\d* mm \(cam at "
        r"92\.\d* deg\); the base circle must be larger by more than 0\.917\d* mm: the profile is undercut from",
    ),
    "face on the axle": (
        lambda: followers.lifted_face(offset=-1.0),
        r"\[joints\.lift\] the flat face reaches the cam's axle: its distance is -1 mm from it",
    ),
    "law without repetition": (
        lambda: followers.lifted_roller(8.0, kinfmu.Cycloidal(10.0, 1.0)),
        "cam 'lift': the cam has no closed profile: law 'cycloidal' does not repeat",
    ),
}


@pytest.mark.parametrize("case", WRONG)
@pytest.mark.few(3)
def test_a_cam_without_a_profile_is_reported_with_the_reason(case: str) -> None:
    made, message = WRONG[case]
    with pytest.raises(MechanismError, match=message):
        kinfmu.cam_profile(made(), "lift")


@pytest.mark.parametrize("kind", [kinfmu.CamRoller, kinfmu.CamFlatFace])
@pytest.mark.parametrize("pole", [(0.0, 0.0), (2.0, -1.0)])
@pytest.mark.few(2)
def test_a_lever_on_the_axle_of_its_cam_turns_with_it_and_has_no_profile(kind: Any, pole: Any) -> None:
    mechanism = followers.coaxial(kind, pole)
    why = r"the follower 'lever' is pinned at the cam's axle, 'ground\.O', so that it turns with the cam"
    with pytest.raises(MechanismError, match=why):
        kinfmu.cam_profile(mechanism, "curve")
    assert re.search(f"note curve: no profile, because {why}", unwrapped(kinfmu.check(mechanism)))
    run = kinfmu.solve(mechanism, cam_angle=np.linspace(0.0, TURN, 9))
    np.testing.assert_allclose(run["lever.phi"] - run["cam.phi"], run["lever.phi"][0], rtol=0.0, atol=1e-12)


def test_check_reports_an_undercut_cam_as_its_problem_and_the_motion_is_still_solved() -> None:
    mechanism = followers.lifted_roller(31.0)
    report = kinfmu.check(mechanism)
    assert isinstance(report.problem, MechanismError)
    assert "undercut from cam at" in unwrapped(report)
    assert kinfmu.solve(mechanism, cam_angle=[0.0, 1.0]).good.all()
    (found,) = report.as_json()["cams"]
    assert found["undercut"][0]["begin"] < found["smallest_pitch_radius"]["at"] < found["undercut"][0]["end"]
    # the ends are where the pitch curve has the roller's radius
    ends = kinfmu.cam_profile(followers.lifted_roller(8.0), "lift", [*found["undercut"][0].values()]).radius
    np.testing.assert_allclose(ends, 23.0, rtol=1e-8)


@pytest.mark.parametrize("made", [followers.lifted_face, lambda: followers.lifted_roller(31.0)])
def test_pages_hold_flat_faces_and_cams_that_cannot_be_made(made: Any) -> None:
    mechanism = made()
    found = describe(mechanism, kinfmu.check(mechanism))
    kinds = {shape["kind"]: shape for shape in found["shapes"] if shape["name"] == "lift"}
    assert ("cam" in kinds) == ("face" in kinds) == (made is followers.lifted_face)
    assert "line" not in kinds.get("rod", {})


def test_check_reports_a_steep_cam_as_a_note_and_its_text_once_as_poor() -> None:
    report = kinfmu.check(followers.lifted_roller(8.0, followers.rise_and_return(30.0), offset=25.0))
    notes = [note for note in report.notes if "pressure angle" in note]
    assert len(notes) == 1
    assert unwrapped(report).count(notes[0]) == unwrapped(report).count(f" poor {notes[0]}\n") == 1
    assert "above 30 deg, the usual limit of translating followers" in notes[0]
    assert not [note for note in kinfmu.check(followers.lifted_roller(8.0)).notes if "pressure angle" in note]


def table(law: Law) -> Spline:
    """Return a law of a turn as a table."""
    points = [(x, float(law.at(x))) for x in np.linspace(0.0, TURN, 73).tolist()]
    return Spline((*points[:-1], (TURN, points[0][1])), ends="periodic")


@pytest.mark.parametrize("form", ["sequence", "table", "harmonic"])
@pytest.mark.parametrize("joint", ["swinging", "translating"])
@pytest.mark.few(2)
def test_the_note_on_a_steep_cam_names_a_wrong_sign_of_the_lift(joint: str, form: str) -> None:
    """A rise towards the cam; the number of the opposite sign is that of the mended file."""

    def made(sign: float) -> kinfmu.Mechanism:
        height = sign * (15.0 if joint == "translating" else 0.5)
        law: Law = followers.rise_and_return(height)
        if form == "table":
            law = table(law)
        if form == "harmonic":
            law = Harmonic(0.5 * height, 1.0, 0.5 * height, math.radians(-90.0))
        if joint == "translating":
            return followers.lifted_roller(2.0, law, offset=22.0)
        return followers.swinging(
            CamOscillating("lift", ("ground", "follower"), "cam", law, -0.5, contact="follower.F", roller_radius=0.5)
        )

    outwards = 1.0 if joint == "translating" else -1.0
    (note,) = (note for note in kinfmu.check(made(-outwards)).notes if "pressure angle" in note)
    mended = kinfmu.cam_profile(made(outwards), "lift", np.linspace(0.0, math.tau, 7201)).pressure_angle
    words = "the lift moves the follower towards the cam: with lifts of the opposite sign it is "
    assert words in note
    assert float(note.partition(words)[2].removesuffix(" deg")) == pytest.approx(
        math.degrees(np.abs(mended).max()), rel=1e-5
    )


@pytest.mark.parametrize("phase", [0.0, math.pi])
def test_a_motion_to_both_sides_has_no_wrong_sign(phase: float) -> None:
    wave = Harmonic(amplitude=12.0, frequency=1.0, phase=phase)
    for law in (wave, table(wave)):
        found = kinfmu.check(followers.lifted_roller(2.0, law, offset=22.0))
        (note,) = (note for note in found.notes if "pressure angle" in note)
        assert note.endswith("; a larger base circle lowers it")


def test_a_roller_that_cuts_the_profile_elsewhere_is_reported() -> None:
    """A pitch curve with a waist 12 wide between lobes of radius above 9: a roller of radius 7 cuts it through."""
    a, b = 20.2267, 19.7767  # of a hippopede, r^2 = 4 b (a - b sin^2)
    t = np.linspace(0.0, TURN, 1440, endpoint=False)
    curve = np.sqrt(4.0 * b * (a - b * np.sin(t) ** 2)) * np.exp(1j * t)
    along = np.roll(curve, -1) - np.roll(curve, 1)
    found = Traced(t, t, curve, curve + 25.0, -1j * along / np.abs(along), t, t, t)
    for radius, depth in ((5.0, 0.0), (7.0, 2.0)):
        placed = PlacedCam(None, "", "", "", 0j, 0j, 0.0, 0.0, 0.0, 0j, None, 0j, None, radius)  # type: ignore[arg-type]
        gouge = critical._gouge(placed, found)
        assert (0.0 if gouge is None else gouge.value) == pytest.approx(depth, abs=0.1)


def test_wrong_requests_are_reported() -> None:
    mechanism = followers.lifted_roller(8.0)
    with pytest.raises(RequestError, match=r"'lifd' is not a cam joint of cam; did you mean 'lift'\?; known: lift"):
        kinfmu.cam_profile(mechanism, "lifd")
    with pytest.raises(RequestError, match=r"fourbar has no cam; joints of cams: cam_translating, cam_oscillating, "):
        kinfmu.cam_profile(kinfmu.load("fourbar"), "AB")
    with pytest.raises(RequestError, match=r"tolerance = -1\.0 must be a positive length"):
        kinfmu.cam_profile(mechanism, "lift", tolerance=-1.0)
    for wrong, message in (
        ({"roller_radius": -1.0}, r"\[joints.lift\] roller_radius = -1.0 must be 0 or more"),
        ({"roller_radius": 1.0, "normal": 0.0}, r"\[joints.lift\] has both 'roller_radius' and 'normal'"),
    ):
        with pytest.raises(MechanismError, match=message):
            followers.sliding(
                kinfmu.CamTranslating("lift", ("ground.O", "follower.F"), "cam", kinfmu.Harmonic(1.0, 1.0), **wrong)
            )
    with pytest.raises(MechanismError, match=r"\[joints.lift\] needs the key 'contact'"):
        followers.swinging(
            kinfmu.CamOscillating("lift", ("ground", "follower"), "cam", kinfmu.Harmonic(0.1, 1.0), roller_radius=1.0)
        )
    with pytest.raises(MechanismError, match=r"contact = 'cam.O' must be a point of the follower 'follower'"):
        followers.swinging(
            kinfmu.CamOscillating("lift", ("ground", "follower"), "cam", kinfmu.Harmonic(0.1, 1.0), contact="cam.O")
        )


def test_a_polygon_keeps_its_tolerance() -> None:
    mechanism = followers.lifted_roller(8.0)
    corners = kinfmu.cam_profile(mechanism, "lift", tolerance=0.01).profile
    dense = kinfmu.cam_profile(mechanism, "lift", np.linspace(0.0, TURN, 20001)).profile
    a, b = complexes(corners), complexes(np.roll(corners, -1, axis=0))
    worst = 0.0
    for point in complexes(dense)[::7]:
        part = np.clip(((point - a) * (b - a).conj()).real / np.abs(b - a) ** 2, 0.0, 1.0)
        worst = max(worst, float(np.abs(a + part * (b - a) - point).min()))
    assert 0.001 < worst <= 0.01


def test_the_table_holds_what_the_profile_holds(tmp_path: Any) -> None:
    profile = kinfmu.cam_profile(followers.lifted_face(), "lift")
    profile.write_csv(tmp_path / "cam.csv", units=True)
    lines = (tmp_path / "cam.csv").read_text().splitlines()
    assert lines[0] == (
        "cam_angle [rad],x [mm],y [mm],follower [mm],pressure_angle [rad],radius_of_curvature [mm],face_offset [mm]"
    )
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    np.testing.assert_array_equal(table[:, 1:3], profile.profile)
    with pytest.raises(KinfmuError, match="cannot be written"):
        profile.write_csv(tmp_path / "cam.csv" / "below_a_file.csv")
