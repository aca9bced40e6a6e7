"""Cams: the pitch curve goes through the roller's centre and the profile touches the roller, at every angle."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, RunSettings, Translational
from kinfmu.analysis import cam_profile
from kinfmu.draw.cam_figure import _figure
from kinfmu.draw.instant import instant
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.joints import CamShape, cam_shapes
from kinfmu.draw.scene.scene import scene
from kinfmu.draw.scene.shape import Shape, guides_of_cams
from kinfmu.draw.scene.strokes import on_face
from kinfmu.draw.sheet import ink
from kinfmu.fmu.picture import picture
from kinfmu.log.urdf import robot_description
from kinfmu.mechanism.joints import CamFlatFace, CamOscillating, CamRoller, CamTranslating
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import Harmonic, Law, MotionSequence, Segment, Spline
from tests.motion.cams import followers
from tests.motion.cams.test_profile import geared

QUARTER = 0.5 * math.pi
RADIUS = 6.0  # of the roller


def lift(height: float, start: float = 0.0) -> Law:
    """Up, dwell, down, dwell, in a turn."""
    turn = (2.0, 1.0, 2.0, 2.0 * math.pi - 5.0)
    laws = ("cycloidal", "dwell", "cycloidal", "dwell")
    rises = (height, 0.0, -height, 0.0)
    return MotionSequence(tuple(map(Segment, laws, turn, rises)), start=start, repeat=True)


def cam(follower: Body, guide: Joint, contact: Joint, angle: float) -> Mechanism:
    """A cam about the origin at an angle [rad], its follower held by a guide."""
    return Mechanism(
        "cam",
        [Body("ground", {"O": (0, 0), "G": (5, 80), "C": (60, 0)}), Body("cam", {"O": (0, 0)}), follower],
        [Revolute("O", ("ground.O", "cam.O")), guide, contact],
        [AngleDriver("cam", "cam", ConstantSpeed(angle, 1.0))],
        run=RunSettings(0.0, 0.0),
    )


def translating(contact: Joint, angle: float) -> CamShape:
    follower = Body("follower", {"tip": (0, 0), "stem": (0, 45)}, (5, 30, 0))
    guide = Translational("guide", ("ground.G", "follower.stem"), QUARTER)
    return the_disc(cam(follower, guide, contact, angle))


def oscillating(angle: float) -> CamShape:
    follower = Body("follower", {"C": (0, 0), "tip": (50, 0)}, (60, 0, 2.3))
    contact = CamOscillating(
        "contact", ("ground", "follower"), "cam", lift(0.4), 2.2, contact="follower.tip", roller_radius=RADIUS
    )
    return the_disc(cam(follower, Revolute("C", ("ground.C", "follower.C")), contact, angle))


def the_disc(mechanism: Mechanism) -> CamShape:
    (disc,) = cam_shapes(instant(mechanism))
    return disc


def drawn(kind: str, angle: float) -> CamShape:
    if kind == "oscillating":
        return oscillating(angle)
    if kind == "roller":
        return translating(CamRoller("contact", ("cam.O", "follower.tip"), lift(12.0, start=25.0), RADIUS), angle)
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(12.0), QUARTER, 30.0, RADIUS)
    return translating(contact, angle)


def distance_to(curve: np.ndarray, point: np.ndarray) -> float:
    """Of a point from a closed curve (k, 2), measured to its sides."""
    a, d = curve, np.roll(curve, -1, axis=0) - curve
    part = np.clip(((point - a) * d).sum(axis=1) / (d * d).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(a + part[:, None] * d - point).T).min())


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5, 4.0, 5.9])
@pytest.mark.parametrize("kind", ["translating", "oscillating", "roller"])
@pytest.mark.few(8)
def test_the_roller_is_on_the_pitch_curve_and_touches_the_profile(kind: str, angle: float) -> None:
    disc = drawn(kind, angle)
    assert disc.profile is not None
    assert disc.pitch is not None
    assert disc.contact is not None
    assert disc.radius == RADIUS
    np.testing.assert_allclose(np.hypot(*(disc.profile - disc.pitch).T), RADIUS, rtol=1e-12)
    assert distance_to(disc.pitch, disc.roller) < 1e-2  # of 30: the curve has a corner each degree
    assert np.hypot(*(disc.contact - disc.roller)) == pytest.approx(RADIUS, abs=1e-11)
    assert distance_to(disc.profile, disc.contact) < 1e-2
    gaps = np.hypot(*(disc.profile - disc.roller).T) - RADIUS
    assert gaps.min() > -1e-9


@pytest.mark.parametrize("kind", ["translating", "oscillating", "roller"])
def test_a_cam_turns_as_one_piece(kind: str) -> None:
    first, second = drawn(kind, 0.0), drawn(kind, 1.0)
    assert first.pitch is not None
    assert second.pitch is not None
    c, s = math.cos(1.0), math.sin(1.0)
    np.testing.assert_allclose(second.pitch, first.pitch @ np.array([[c, s], [-s, c]]), atol=1e-9)


def test_an_eccentric_is_drawn_as_a_circle() -> None:
    law = Harmonic(0.0, 1.0)
    level = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", law, QUARTER, 30.0, RADIUS)
    disc = translating(level, 0.4)
    assert disc.profile is not None
    np.testing.assert_allclose(np.hypot(*disc.profile.T), math.hypot(5.0, 30.0) - RADIUS, rtol=1e-12)


def test_a_flat_face_is_drawn_where_it_touches_the_profile() -> None:
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(8.0), QUARTER, 30.0, normal=QUARTER)
    for joint in (contact, CamFlatFace("contact", ("cam.O", "follower.tip"), Harmonic(5.0, 1.0, 30.0), QUARTER)):
        disc = translating(joint, 0.9)
        assert disc.profile is not None
        assert disc.face is not None
        assert disc.contact is not None
        assert disc.pitch is None
        np.testing.assert_allclose(disc.face[:, 1], disc.contact[1], rtol=1e-12)
        assert disc.face[:, 0].min() < disc.contact[0] < disc.face[:, 0].max()
        assert disc.profile[:, 1].max() == pytest.approx(disc.contact[1], abs=1e-2)


def test_a_flat_face_is_connected_with_its_point(tmp_path: Path) -> None:
    """The contact of an eccentric disc stays 35 to 55 from the follower's point, which the face reaches too."""
    joint = CamFlatFace("contact", ("cam.O", "follower.tip"), Harmonic(10.0, 1.0, 30.0), QUARTER)
    follower = Body("follower", {"tip": (40, 0), "stem": (0, 45)}, (5, 30, 0))
    mechanism = cam(follower, Translational("guide", ("ground.G", "follower.stem"), QUARTER), joint, 0.9)
    shown = instant(mechanism)
    (disc,) = cam_shapes(shown)
    tip = shown.point("follower.tip")
    assert disc.face is not None
    assert disc.contact is not None
    assert disc.reach == pytest.approx((tip[0] - 10.0, tip[0] + 10.0), abs=2e-3)  # a sample each degree
    np.testing.assert_allclose(disc.face[0], tip, atol=1e-9)
    assert disc.face[1, 0] < disc.contact[0] - 1.0
    kinfmu.draw.figure(mechanism, tmp_path / "face.svg")
    text = (tmp_path / "face.svg").read_text("utf-8")
    assert f"contact: contact {tip[0] - 10.0:.4g} to {tip[0] + 10.0:.4g} m from follower.tip" in text


def test_the_picture_of_a_cam_names_its_lines_and_shows_the_sense_of_its_angle() -> None:
    outline, pressure, _ = _figure(cam_profile(kinfmu.load("cam_roller"), "pitch")).axes
    names = [text.get_text() for text in outline.get_legend().get_texts()]
    assert names == ["base circle", "pitch curve", "roller at 0\N{DEGREE SIGN}", "angle of the cam"]
    assert [text.get_text() for text in pressure.get_legend().get_texts()] == ["usual limit"]
    (arrow,) = (line for line in outline.lines if line.get_label() == "angle of the cam")
    assert (np.diff(np.unwrap(np.arctan2(*arrow.get_xydata().T[::-1]))) > 0.0).all()  # counter-clockwise


@pytest.mark.parametrize("ratio", [-1.0, 2.0, -0.5])
def test_the_picture_of_a_geared_cam_shows_the_sense_in_which_its_driver_turns_it(ratio: float) -> None:
    profile = cam_profile(geared(followers.lifted_roller(8.0), ratio), "lift")
    arrows = {
        line.get_label(): np.diff(np.unwrap(np.arctan2(*(line.get_xydata() - profile.axle).T[::-1])))
        for line in _figure(profile).axes[0].lines
    }
    assert (arrows["angle of the cam"] > 0.0).all()  # counter-clockwise
    assert (arrows["rotation with motor"] * ratio > 0.0).all()


@pytest.mark.parametrize("radius", [None, 29.5])
def test_a_profile_that_is_not_known_or_not_possible_is_not_drawn(radius: float | None) -> None:
    """Of an unknown roller, and of one that would undercut."""
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(12.0), QUARTER, 30.0, radius)
    disc = translating(contact, 0.4)
    assert disc.profile is None
    assert disc.contact is None
    assert disc.radius == 0.0
    assert disc.pitch is not None


def test_the_drawn_bar_of_a_flat_face_touches_its_cam() -> None:
    """Its edge lies on the line of the face: the middle of the bar is half of its width away from the profile."""
    axes = Figure(figsize=(8.0, 6.0)).subplots()
    mechanism = kinfmu.load("flat_face_lever")
    for value in (0.0, 1.0, 2.5, 4.0):
        axes.clear()
        kinfmu.draw.figure(mechanism, at=value, ax=axes)
        low, high = axes.get_xlim()
        point = (high - low) / (axes.get_window_extent().width * 72.0 / axes.figure.dpi)  # of a printer [length]
        outlines = {patch.get_edgecolor(): patch for patch in axes.patches if len(patch.get_path().vertices) > 300}
        (profile,) = (patch.get_path().vertices for patch in outlines.values())
        edge = ink(palette.darker(palette.body(1)))
        bars = [patch for patch in axes.patches if patch.get_edgecolor()[:3] == edge]
        assert len(bars) == 2  # the lever's link, and the line of its face
        for bar in bars:
            gap = min(distance_to(bar.get_path().vertices, corner) for corner in profile[::4])
            assert gap == pytest.approx(bar.get_linewidth() / 2.0 * point, rel=0.15)


def test_a_stem_ends_at_the_face_and_other_points_stay() -> None:
    face = Shape("face", "contact", "follower", np.array([[-4.0, 1.0], [4.0, 1.0]]), direction=np.array([0.0, 1.0]))
    points = np.array([[0.0, 1.0], [0.0, 9.0], [2.0, 1.001]])
    np.testing.assert_array_equal(on_face(points, face, 0.5), [[0.0, 1.5], [0.0, 9.0], [2.0, 1.001]])
    np.testing.assert_array_equal(on_face(face.points, face, 0.5)[:, 1], 1.5)


def test_a_pitch_curve_without_a_profile_counts_as_drawn() -> None:
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(12.0), QUARTER, 30.0)
    follower = Body("follower", {"tip": (0, 0), "stem": (0, 45)}, (5, 30, 0))
    mechanism = cam(follower, Translational("guide", ("ground.G", "follower.stem"), QUARTER), contact, 0.4)
    axes = kinfmu.draw.figure(mechanism, ax=Figure().subplots())
    assert not [text.get_text() for text in axes.texts if "not drawn" in text.get_text()]


def test_a_profile_that_its_roller_cuts_at_another_place_is_not_drawn() -> None:
    """A pitch curve with a waist 12 wide between lobes of radius above 9: a roller of radius 7 cuts it through."""
    a, b = 20.2267, 19.7767  # of a hippopede, r^2 = 4 b (a - b sin^2)
    turn = np.linspace(0.0, 2.0 * math.pi, 181)
    distances = np.sqrt(4.0 * b * (a - b * np.sin(turn) ** 2))
    law = Spline(tuple(zip(turn.tolist(), [*distances[:-1].tolist(), float(distances[0])], strict=True)), "periodic")
    for radius, is_drawn in ((5.0, True), (7.0, False)):
        shape = translating(CamRoller("contact", ("cam.O", "follower.tip"), law, radius), QUARTER)
        assert (shape.profile is not None) == is_drawn
        assert shape.pitch is not None


@pytest.fixture
def tappet() -> Mechanism:
    """A cam whose follower slides with the roller's centre, so that its block is round the roller."""
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(12.0), QUARTER, 30.0, RADIUS)
    guide = Translational("guide", ("ground.G", "follower.tip"), QUARTER)
    return cam(Body("follower", {"tip": (0, 0)}, (5, 30, 0)), guide, contact, 0.4)


def test_the_block_of_a_follower_hides_neither_cam_nor_roller_in_figures(tappet: Mechanism) -> None:
    patches = sorted(kinfmu.draw.figure(tappet, ax=Figure().subplots()).patches, key=lambda patch: patch.zorder)
    follower = ink(palette.lighter(palette.body(1)))
    (block,) = (k for k, patch in enumerate(patches) if patch.get_facecolor()[:3] == follower)
    (profile,) = (
        k for k, patch in enumerate(patches) if len(patch.get_path().vertices) > 300 and patch.get_facecolor()[3]
    )
    sizes = [np.ptp(patch.get_path().vertices, axis=0) for patch in patches]
    rollers = [k for k, size in enumerate(sizes) if size == pytest.approx([2.0 * RADIUS] * 2)]
    assert rollers[0] < block < profile < rollers[1]
    assert patches[rollers[1]].get_facecolor()[3] == 0.0


def test_the_block_of_a_follower_hides_neither_cam_nor_roller_in_fmus_and_records(tappet: Mechanism) -> None:
    run = kinfmu.solve(tappet, [0.0])
    drawn = picture(run)
    assert drawn is not None
    areas = [line.colours[1] for line in drawn.lines]
    block, profile = (areas.index(palette.lighter(palette.body(k))) for k in (1, 0))
    assert block < profile
    text = robot_description("tappet", scene(run, tappet), 1.0)
    visuals = re.search(r'<link name="follower">(.*?)</link>', text)
    assert visuals is not None
    boxes = re.findall(r'<origin xyz="\S+ \S+ (\S+)" rpy="[^"]*"/><geometry><box size="\S+ \S+ (\S+)"', visuals[1])
    tops = sorted((float(size), float(height) + 0.5 * float(size)) for height, size in boxes)
    *sides, (_, block_top) = tops  # the block is the largest box
    assert len(sides) >= 24  # of the roller
    assert all(top > block_top for _, top in sides)


def test_blocks_of_followers_are_known(tappet: Mechanism) -> None:
    assert guides_of_cams(scene(kinfmu.solve(tappet, [0.0]), tappet).shapes) == {"guide"}
    others = [kinfmu.load(name) for name in ("cam_roller", "slider_crank", "rack_steering")]
    assert not any(guides_of_cams(scene(kinfmu.solve(one, [0.0]), one).shapes) for one in others)
