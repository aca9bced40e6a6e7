from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, normalized, polynomial
from kinfmu.solver.python.curve import CurveData


@dataclass(frozen=True)
class Polynomial4567(Rise):
    """A rise along the polynomial of powers 4 to 7, at rest with neither acceleration nor jerk at both ends.

        N = 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7        u = start + rise N

    Peaks: velocity 35/16 = 2.188, acceleration 7.513.
    """

    type: ClassVar[str] = "4-5-6-7"
    shape: ClassVar[CurveData] = normalized([(0.0, polynomial(0.0, -20.0, 70.0, -84.0, 35.0, 0.0, 0.0, 0.0, 0.0))])
