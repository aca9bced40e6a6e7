"""The angle of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.arithmetic import Value
from kinfmu.joints.measures.measure import Measure
from kinfmu.joints.placement import Placement


@dataclass(frozen=True)
class AngleBetween(Measure):
    """Angle of body `of` against body `to`: phi_of - phi_to, turns kept; without `to` against the world."""

    kind: ClassVar[str] = "angle"

    of: str
    to: str | None = None

    def bodies(self) -> tuple[str, ...]:
        return (self.of,) if self.to is None else (self.to, self.of)

    def value(self, at: Placement) -> Value:
        return at.angle(self.of) if self.to is None else at.angle(self.of) - at.angle(self.to)
