from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, normalized
from kinfmu.solver.python.curve import CurveData


@dataclass(frozen=True)
class Cycloidal(Rise):
    """A rise whose acceleration is a whole sine.

        N = x - sin(2 pi x) / (2 pi)        u = start + rise N

    Peaks: velocity 2, acceleration 2 pi = 6.283.
    """

    type: ClassVar[str] = "cycloidal"
    shape: ClassVar[CurveData] = normalized([(0.0, (0.0, (1.0, 0.0), -0.5 / math.pi, 2.0 * math.pi, 0.0))])
