"""The angle of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.measures.arithmetic import Value
from kinfmu.measures.measure import Measure
from kinfmu.measures.placement import BodyName, Placement, Reference


@dataclass(frozen=True)
class AngleBetween(Measure):
    """Angle of a body relative to another or to the world: phi_of - phi_to, with whole turns."""

    type: ClassVar[str] = "angle"
    kind: ClassVar[str] = "angle"

    of: Annotated[BodyName, "the body"]
    to: Annotated[str | None, Reference("body"), "the reference body; default: the world"] = None

    def bodies(self) -> tuple[str, ...]:
        return (self.of,) if self.to is None else (self.to, self.of)

    def value(self, at: Placement) -> Value:
        return at.angle(self.of) if self.to is None else at.angle(self.of) - at.angle(self.to)
