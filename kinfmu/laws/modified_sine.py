from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, normalized
from kinfmu.solver.python.curve import CurveData

_SLOPE = math.pi / (4.0 + math.pi)
_WAVE = 0.25 / (4.0 + math.pi)


@dataclass(frozen=True)
class ModifiedSine(Rise):
    """A rise whose acceleration is a sine, quicker in the first and last eighth than between them.

        N'' = A sin(4 pi x)                     up to 1/8,   A = 4 pi^2 / (4 + pi)
        N'' = A sin(4 pi x / 3 + pi / 3)        up to 7/8
        N'' = A sin(4 pi x)                     up to 1      u = start + rise N

    Peaks: velocity 4 pi / (4 + pi) = 1.760, acceleration A = 5.528.
    """

    type: ClassVar[str] = "modified_sine"
    shape: ClassVar[CurveData] = normalized(
        [
            (0.0, (0.0, (_SLOPE, 0.0), -_WAVE, 4.0 * math.pi, 0.0)),
            (0.125, (0.5, (_SLOPE, 0.5), 9.0 * _WAVE, 4.0 * math.pi / 3.0, 0.0)),
        ]
    )
