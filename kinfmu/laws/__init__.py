"""Laws, one a file: how one quantity follows another, as a driver follows time and a follower the angle of its cam.

Adding one is a file and a line here.
"""

from __future__ import annotations

from kinfmu.laws.constant_speed import ConstantSpeed
from kinfmu.laws.cycloidal import Cycloidal
from kinfmu.laws.external import External
from kinfmu.laws.harmonic import Harmonic
from kinfmu.laws.law import Constant, Law, LawQuantity
from kinfmu.laws.modified_sine import ModifiedSine
from kinfmu.laws.modified_trapezoid import ModifiedTrapezoid
from kinfmu.laws.polynomial import Polynomial
from kinfmu.laws.polynomial_345 import Polynomial345
from kinfmu.laws.polynomial_4567 import Polynomial4567
from kinfmu.laws.rise import Rise
from kinfmu.laws.sequence import RISES, MotionSequence, Segment
from kinfmu.laws.simple_harmonic import SimpleHarmonic
from kinfmu.laws.spline import Spline

LAWS: tuple[type[Law], ...] = (
    ConstantSpeed,
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
    "Constant",
    "ConstantSpeed",
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
