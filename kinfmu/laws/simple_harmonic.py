from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, polynomial
from kinfmu.solver.python.curve import CurveData


@dataclass(frozen=True)
class SimpleHarmonic(Rise):
    """A rise along half a cosine; its acceleration jumps at both ends.

        N = (1 - cos pi x) / 2        u = start + rise N

    Peaks: velocity pi / 2, acceleration pi^2 / 2.
    """

    type: ClassVar[str] = "simple_harmonic"
    shape: ClassVar[CurveData] = (
        (0.0, 1.0),
        (polynomial(0.0, 0.0), (0.5, (0.5,), 0.5, math.pi, 0.0), polynomial(1.0, 1.0)),
    )
