from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.errors import MechanismError
from kinfmu.joints.joint import Condition, Joint
from kinfmu.measures import AngleBetween
from kinfmu.measures.arithmetic import Value
from kinfmu.measures.placement import BodyName, BodyPair, Placement
from kinfmu.units import Number, Radians


@dataclass(frozen=True)
class Gear(Joint):
    """A pair of gears on a carrier: their angles against it keep a ratio.

        Phi = (phi_j - phi_k) - ratio (phi_i - phi_k) - offset        (1 row)

    between: gears i and j; carrier: body k that holds both axles; ratio: negative for outer gears (-z_i / z_j of the
    teeth), positive for an inner one or a belt; offset: angle of j where i stands at 0 [rad]. After Haug (1989), gears;
    there as rolling pitch circles.
    """

    type: ClassVar[str] = "gear"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    between: BodyPair
    ratio: Number
    carrier: BodyName = "ground"
    offset: Radians = 0.0

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
