from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, normalized, polynomial
from kinfmu.solver.python.curve import CurveData

_PEAK = 8.0 * math.pi / (2.0 + math.pi)  # A
_SLOPE = 2.0 / (2.0 + math.pi)  # N' at 1/8
_WAVE = 0.5 / (math.pi * (2.0 + math.pi))
_EIGHTH = (math.pi - 2.0) / (4.0 * math.pi * (2.0 + math.pi))  # N at 1/8


@dataclass(frozen=True)
class ModifiedTrapezoid(Rise):
    """A rise whose acceleration is a trapezoid with its edges rounded by quarters of a sine.

        N'' = A sin(4 pi x)             up to 1/8,   A = 8 pi / (2 + pi)
        N'' = A                         up to 3/8
        N'' = A cos(4 pi x - 3 pi / 2)  up to 5/8, then mirrored        u = start + rise N

    Peaks: velocity 2, acceleration A = 4.888.
    """

    type: ClassVar[str] = "modified_trapezoid"
    shape: ClassVar[CurveData] = normalized(
        [
            (0.0, (0.0, (_SLOPE, 0.0), -_WAVE, 4.0 * math.pi, 0.0)),
            (0.125, polynomial(0.125, 0.5 * _PEAK, _SLOPE, _EIGHTH)),
            (0.375, (0.5, (2.0 - _SLOPE, 0.5), _WAVE, 4.0 * math.pi, 0.0)),
        ]
    )
