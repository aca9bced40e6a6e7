"""Laws: how one quantity follows another, such as a cam follower the cam.

To add one, write a file and add a line here; a rise of cams is a class in rise.py, which `RISES` lists.
"""

from __future__ import annotations

from kinfmu.mechanism.laws.formulas import ConstantSpeed, ConstantValue, External, Harmonic, Polynomial
from kinfmu.mechanism.laws.law import Law, LawQuantity
from kinfmu.mechanism.laws.rise import (
    RISES,
    Cycloidal,
    ModifiedSine,
    ModifiedTrapezoid,
    Polynomial345,
    Polynomial4567,
    Rise,
    SimpleHarmonic,
)
from kinfmu.mechanism.laws.sequence import MotionSequence, Segment
from kinfmu.mechanism.laws.spline import Spline

LAWS: tuple[type[Law], ...] = (
    ConstantSpeed,
    ConstantValue,
    Polynomial,
    Harmonic,
    *RISES,
    Spline,
    MotionSequence,
    External,
)

__all__ = [
    "LAWS",
    "RISES",
    "ConstantSpeed",
    "ConstantValue",
    "Cycloidal",
    "External",
    "Harmonic",
    "Law",
    "LawQuantity",
    "ModifiedSine",
    "ModifiedTrapezoid",
    "MotionSequence",
    "Polynomial",
    "Polynomial345",
    "Polynomial4567",
    "Rise",
    "Segment",
    "SimpleHarmonic",
    "Spline",
]
