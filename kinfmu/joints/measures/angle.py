"""The angle of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.joints.arithmetic import Value
from kinfmu.joints.measures.measure import Measure
from kinfmu.joints.placement import BodyName, Placement, Reference


@dataclass(frozen=True)
class AngleBetween(Measure):
    """Angle of body `of` against body `to`: phi_of - phi_to, turns kept; without `to` against the world."""

    type: ClassVar[str] = "angle"
    kind: ClassVar[str] = "angle"

    of: BodyName
    to: Annotated[str | None, Reference("body")] = None

    def bodies(self) -> tuple[str, ...]:
        return (self.of,) if self.to is None else (self.to, self.of)

    def value(self, at: Placement) -> Value:
        return at.angle(self.of) if self.to is None else at.angle(self.of) - at.angle(self.to)
