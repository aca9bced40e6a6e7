from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.joint import Condition, Joint
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import BodyName, BodyPair, Placement
from kinfmu.units import Number, Radians


@dataclass(frozen=True)
class Gear(Joint):
    """A pair of gears on a carrier: their angles relative to it keep a ratio.

        Phi = (phi_j - phi_k) - ratio (phi_i - phi_k) - offset        (1 row)

    After Haug (1989), gears, which are given there as rolling pitch circles.
    """

    type: ClassVar[str] = "gear"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    between: Annotated[BodyPair, "gears i and j"]
    ratio: Annotated[
        Number,
        "negative for external gears (-z_i / z_j of the teeth), positive for an internal one or a belt",
    ]
    carrier: Annotated[BodyName, "body k that holds both axles"] = "ground"
    offset: Annotated[Radians, "angle of j where the angle of i is 0 [rad]"] = 0.0

    def check(self) -> None:
        if self.ratio == 0.0:
            raise MechanismError(f"[joints.{self.name}] ratio = 0.0 must be other than 0", joint=self.name)
        if self.carrier in self.between:
            raise MechanismError(
                f"[joints.{self.name}] carrier = '{self.carrier}' must be another body than the gears", joint=self.name
            )

    def conditions(self) -> tuple[Condition, ...]:
        return (Condition("ratio", self.ratio, "other than 0"),)

    def bodies(self) -> tuple[str, ...]:
        return (*self.between, self.carrier)

    def residual(self, at: Placement) -> tuple[Value, ...]:
        i, j = (AngleBetween(gear, self.carrier).value(at) for gear in self.between)
        return (j - self.ratio * i - self.offset,)

    def kinds(self) -> tuple[str, ...]:
        return ("angle",)
