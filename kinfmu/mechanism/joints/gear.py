"""Joints of pitch circles that roll: a pair of gears, and a rack with its pinion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.joint import Condition, Joint
from kinfmu.mechanism.quantities import AngleBetween, PositionAlong
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import BodyName, BodyPair, Placement, PointPair, body_of
from kinfmu.units import Length, Number, Radians


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


@dataclass(frozen=True)
class RackAndPinion(Joint):
    """A rack that slides on the body that holds the pinion: its travel equals the arc length rolled by the pinion.

        Phi = e.d - radius (phi_k - phi_i) - offset,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    After Haug (1989), rack and pinion.
    """

    type: ClassVar[str] = "rack_and_pinion"
    labels: ClassVar[tuple[str, ...]] = ("way",)

    name: str
    between: Annotated[PointPair, "a point of body i, which holds pinion and slide, then a point of the rack j"]
    pinion: Annotated[BodyName, "the pinion, body k"]
    radius: Annotated[Length, "radius of the pitch circle; negative if a positive rotation moves the rack against e"]
    axis: Annotated[Radians, "direction e of the slide in i's frame [rad]"] = 0.0
    offset: Annotated[Length, "position of the rack where the angle of the pinion relative to i is 0 [length]"] = 0.0

    def check(self) -> None:
        if self.radius == 0.0:
            raise MechanismError(f"[joints.{self.name}] radius = 0.0 must be other than 0", joint=self.name)
        if self.pinion in map(body_of, self.between):
            raise MechanismError(
                f"[joints.{self.name}] pinion = '{self.pinion}' must be another body than the rack and what holds it",
                joint=self.name,
            )

    def conditions(self) -> tuple[Condition, ...]:
        return (Condition("radius", self.radius, "other than 0"),)

    def bodies(self) -> tuple[str, ...]:
        return (*map(body_of, self.between), self.pinion)

    def residual(self, at: Placement) -> tuple[Value, ...]:
        way = PositionAlong(self.between, self.axis).value(at)
        turn = AngleBetween(self.pinion, body_of(self.between[0])).value(at)
        return (way - self.radius * turn - self.offset,)
