"""Cams: the pitch curve goes through the roller's centre and the profile touches the roller, at every angle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, RunSettings, Translational
from kinfmu.draw.instant import instant
from kinfmu.joints import CamOscillating, CamRoller, CamTranslating
from kinfmu.joints.joint import Joint
from kinfmu.laws import Law, MotionSequence, Polynomial, Segment
from kinfmu.scene.cams import CamShape, cam_shapes

QUARTER = 0.5 * math.pi


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
    contact = CamOscillating("contact", ("ground", "follower"), "cam", lift(0.4), offset=2.2)
    return the_disc(cam(follower, Revolute("C", ("ground.C", "follower.C")), contact, angle))


def the_disc(mechanism: Mechanism) -> CamShape:
    (disc,) = cam_shapes(instant(mechanism))
    return disc


def drawn(kind: str, angle: float) -> CamShape:
    if kind == "oscillating":
        return oscillating(angle)
    if kind == "roller":
        return translating(CamRoller("contact", ("cam.O", "follower.tip"), lift(12.0, start=25.0)), angle)
    contact = CamTranslating("contact", ("ground.O", "follower.tip"), "cam", lift(12.0), axis=QUARTER, offset=30.0)
    return translating(contact, angle)


def distance_to(curve: np.ndarray, point: np.ndarray) -> float:
    """Of a point from a closed curve (k, 2), measured to its sides."""
    a, d = curve, np.roll(curve, -1, axis=0) - curve
    part = np.clip(((point - a) * d).sum(axis=1) / (d * d).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(a + part[:, None] * d - point).T).min())


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5, 4.0, 5.9])
@pytest.mark.parametrize("kind", ["translating", "oscillating", "roller"])
def test_the_roller_is_on_the_pitch_curve_and_touches_the_profile(kind: str, angle: float) -> None:
    disc = drawn(kind, angle)
    assert distance_to(disc.pitch, disc.roller) < 1e-2  # of 30: the curve has a corner each degree
    assert distance_to(disc.profile, disc.roller) == pytest.approx(disc.radius, abs=2e-2)
    assert distance_to(disc.profile, disc.contact) < 5e-2


@pytest.mark.parametrize("kind", ["translating", "oscillating", "roller"])
def test_a_cam_turns_as_one_piece(kind: str) -> None:
    first, second = drawn(kind, 0.0), drawn(kind, 1.0)
    c, s = math.cos(1.0), math.sin(1.0)
    np.testing.assert_allclose(second.pitch, first.pitch @ np.array([[c, s], [-s, c]]), atol=1e-9)


def test_an_eccentric_is_drawn_as_a_circle() -> None:
    level = CamTranslating(
        "contact", ("ground.O", "follower.tip"), "cam", Polynomial((0.0,)), axis=QUARTER, offset=30.0
    )
    disc = translating(level, 0.4)
    np.testing.assert_allclose(np.hypot(*disc.pitch.T), math.hypot(5.0, 30.0), rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*disc.profile.T), math.hypot(5.0, 30.0) - disc.radius, rtol=1e-12)
