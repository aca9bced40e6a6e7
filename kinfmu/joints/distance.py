from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.joints.joint import Condition, Held
from kinfmu.measures import DistanceBetween
from kinfmu.measures.placement import PointPair
from kinfmu.units import Length

SHORTEST = 1e-30  # [length]; squares of shorter lengths lose their digits


@dataclass(frozen=True)
class Distance(Held):
    """Two points, one on each body, at a fixed distance (revolute-revolute link).

        Phi = d.d - L^2,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 2 L)

    Haug (1989), planar composite joints.
    """

    type: ClassVar[str] = "distance"
    labels: ClassVar[tuple[str, ...]] = ("length",)

    name: str
    between: Annotated[PointPair, "the two points 'body.point'"]
    length: Annotated[Length, "L > 0 [length]"]

    def reach(self) -> float:
        return self.length

    def check(self) -> None:
        if not self.length >= SHORTEST:  # NaN too
            raise MechanismError(
                f"[joints.{self.name}] length = {self.length!r} must be a positive number, {SHORTEST:g} or more",
                joint=self.name,
            )

    def conditions(self) -> tuple[Condition, ...]:
        return (Condition("length", self.length, "positive"),)

    def measured(self) -> tuple[DistanceBetween, float]:
        return DistanceBetween(self.between), self.length
