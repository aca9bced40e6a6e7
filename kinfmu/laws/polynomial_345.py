from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.rise import Rise, normalized, polynomial
from kinfmu.solver.python.curve import CurveData


@dataclass(frozen=True)
class Polynomial345(Rise):
    """A rise along the polynomial of powers 3, 4, 5, at rest with no acceleration at both ends.

        N = 10 x^3 - 15 x^4 + 6 x^5        u = start + rise N

    Peaks: velocity 15/8 = 1.875, acceleration 10 / sqrt 3 = 5.774.
    """

    type: ClassVar[str] = "3-4-5"
    shape: ClassVar[CurveData] = normalized([(0.0, polynomial(0.0, 6.0, -15.0, 10.0, 0.0, 0.0, 0.0))])
