"""A cam about (0, 0) of a frame turned against its body, and the four followers of textbooks."""

from __future__ import annotations

import math
from typing import Any

import kinfmu
from kinfmu.mechanism.joints import (
    CamFlatFace,
    CamOscillating,
    CamRoller,
    CamTranslating,
    Joint,
    Revolute,
    Translational,
)
from kinfmu.mechanism.laws import Law, MotionSequence, Segment

UP = math.radians(90.0)
AXLE = (3.0, -2.0)  # of the cam, in its own frame
PIVOT = (60.0, 5.0)


def rise_and_return(height: float, law: str = "cycloidal") -> MotionSequence:
    """Up over 120 deg, dwell of 60, down over 120, dwell of 60."""
    turn = math.radians(120.0)
    parts = ((law, turn, height), ("dwell", turn / 2.0), (law, turn, -height), ("dwell", turn / 2.0))
    return MotionSequence(tuple(Segment(*part) for part in parts), repeat=True)


def mechanism(follower: Any, guide: Joint, contact: Joint) -> kinfmu.Mechanism:
    return kinfmu.Mechanism(
        "cam",
        [kinfmu.Body("ground", {"O": (0, 0), "G": (6, 0), "C": PIVOT}), kinfmu.Body("cam", {"O": AXLE}), follower],
        [Revolute("O", ("ground.O", "cam.O")), guide, contact],
        [kinfmu.AngleDriver("cam", "cam", kinfmu.ConstantSpeed(0.3, 1.0))],
        length_unit="mm",
    )


def sliding(contact: Joint) -> kinfmu.Mechanism:
    """A follower that slides along y at x = 6."""
    follower = kinfmu.Body("follower", {"F": (0, 0)}, (6, 40, 0))
    return mechanism(follower, Translational("guide", ("ground.G", "follower.F"), UP), contact)


def swinging(contact: Joint) -> kinfmu.Mechanism:
    """A lever about (60, 5), its roller or a point of its face 52 from it."""
    follower = kinfmu.Body("follower", {"C": (0, 0), "F": (-52, 0)}, (60, 5, -0.6))
    return mechanism(follower, Revolute("C", ("ground.C", "follower.C")), contact)


def lifted_roller(radius: float | None, law: Law | None = None, offset: float = 32.0) -> kinfmu.Mechanism:
    law = law or rise_and_return(15.0)
    return sliding(CamTranslating("lift", ("ground.O", "follower.F"), "cam", law, UP, offset, radius))


def lifted_face(law: Law | None = None, offset: float = 25.0) -> kinfmu.Mechanism:
    law = law or rise_and_return(10.0, "3-4-5")
    return sliding(CamTranslating("lift", ("ground.O", "follower.F"), "cam", law, UP, offset, normal=UP))


def swung_roller(radius: float = 7.0) -> kinfmu.Mechanism:
    law = rise_and_return(-0.3)
    return swinging(
        CamOscillating("lift", ("ground", "follower"), "cam", law, -0.5, contact="follower.F", roller_radius=radius)
    )


def swung_face(swing: float = -0.2) -> kinfmu.Mechanism:
    law = rise_and_return(swing, "3-4-5")
    return swinging(CamOscillating("lift", ("ground", "follower"), "cam", law, -0.5, contact="follower.F", normal=UP))


def on_pitch_curve(swings: bool, radius: float | None = 7.0) -> kinfmu.Mechanism:
    law = MotionSequence(rise_and_return(8.0).segments, start=36.0, repeat=True)
    joint = CamRoller("lift", ("cam.O", "follower.F"), law, radius)
    return swinging(joint) if swings else sliding(joint)


def on_tangents(swings: bool) -> kinfmu.Mechanism:
    joint = CamFlatFace("lift", ("cam.O", "follower.F"), kinfmu.Harmonic(4.0, 2.0, 30.0, 0.3), UP)
    return swinging(joint) if swings else sliding(joint)


ALL = {
    "translating roller": lambda: lifted_roller(8.0),
    "knife edge": lambda: lifted_roller(0.0),
    "translating face": lifted_face,
    "swinging roller": swung_roller,
    "swinging face": swung_face,
    "roller on a pitch curve, sliding": lambda: on_pitch_curve(swings=False),
    "roller on a pitch curve, swinging": lambda: on_pitch_curve(swings=True),
    "face on a profile, sliding": lambda: on_tangents(swings=False),
    "face on a profile, swinging": lambda: on_tangents(swings=True),
}


def coaxial(kind: type[CamRoller | CamFlatFace], pole: tuple[float, float]) -> kinfmu.Mechanism:
    """A lever on the axle of the cam: it turns with the cam."""
    law = kinfmu.Harmonic(4.0, 1.0, 58.0)
    contact = (
        CamRoller("curve", ("cam.E", "lever.F"), law, 5.0)
        if kind is CamRoller
        else CamFlatFace("curve", ("cam.E", "lever.F"), law, UP)
    )
    at = (60.0, 0.0) if kind is CamRoller else (0.0, 60.0)
    return kinfmu.Mechanism(
        "coaxial",
        [
            kinfmu.Body("ground", {"O": (0, 0)}),
            kinfmu.Body("cam", {"O": (0, 0), "E": pole}),
            kinfmu.Body("lever", {"O": (0, 0), "F": at}, (0, 0, 0.4)),
        ],
        [Revolute("O", ("ground.O", "cam.O")), Revolute("P", ("ground.O", "lever.O")), contact],
        [kinfmu.AngleDriver("cam", "cam", kinfmu.ConstantSpeed(0.0, 1.0))],
        length_unit="mm",
    )
