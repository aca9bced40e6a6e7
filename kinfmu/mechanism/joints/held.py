"""Joints that hold one measured quantity at a value."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.joint import Condition, Joint
from kinfmu.mechanism.quantities import AngleBetween, CoordinateOf, DistanceBetween, OffsetFrom, PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value, decimal_sum
from kinfmu.mechanism.quantities.placement import Axis, BodyName, BodyPair, Placement, PointName, PointPair
from kinfmu.units import Length, Radians

SHORTEST = 1e-30  # [length]; squares of shorter lengths lose their digits


class Held(Joint):
    """One measured quantity, held at a value.

        Phi = quantity - value        (1 row; a quantity may define its own row)

    Leaves define `measured`.
    """

    @abstractmethod
    def measured(self) -> tuple[PoseQuantity, float]:
        """Return the quantity and the value at which it is held."""

    def bodies(self) -> tuple[str, ...]:
        return self.measured()[0].bodies()

    def residual(self, at: Placement) -> tuple[Value, ...]:
        quantity, value = self.measured()
        return (quantity.row(at, value),)

    def scales(self) -> tuple[float, ...]:
        quantity, value = self.measured()
        return (quantity.scale(value),)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        quantity, value = self.measured()
        return (quantity.gap(residual[0], value),)

    def kinds(self) -> tuple[str, ...]:
        return (self.measured()[0].kind,)


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


@dataclass(frozen=True)
class PointOnLine(Held):
    """A pin in a slot: a point of body j stays on a line fixed in body i (revolute-translational link of length 0).

        Phi = n.d,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row, scale 1)

    Haug (1989), planar composite joints.
    """

    type: ClassVar[str] = "point_on_line"
    labels: ClassVar[tuple[str, ...]] = ("across",)

    name: str
    between: Annotated[PointPair, "a point of the line on body i, then the pin on body j"]
    axis: Annotated[Radians, "direction of the line in i's frame [rad]; n is that direction turned by 90 degrees"] = 0.0

    def measured(self) -> tuple[OffsetFrom, float]:
        return OffsetFrom(self.between, self.axis), 0.0


@dataclass(frozen=True)
class Coordinate(Held):
    """A fixed world coordinate of a point: the point slides along a line parallel to an axis.

        Phi = (r_i + A_i s_a)_x - value     or the same with y        (1 row, scale 1)

    Haug (1989), absolute constraints.
    """

    type: ClassVar[str] = "coordinate"
    labels: ClassVar[tuple[str, ...]] = ("value",)

    name: str
    of: Annotated[PointName, "the point 'body.point'"]
    axis: Annotated[Axis, "'x' or 'y'"]
    value: Annotated[Length, "the coordinate [length]"] = 0.0

    def moved(self, dx: float, dy: float) -> Coordinate:
        return replace(self, value=decimal_sum(self.value, dx if self.axis == "x" else dy))

    def measured(self) -> tuple[CoordinateOf, float]:
        return CoordinateOf(self.of, self.axis), self.value


@dataclass(frozen=True)
class Angle(Held):
    """A fixed angle of one body: the body moves without turning.

        Phi = phi_i - value        (1 row)

    Haug (1989), absolute constraints.
    """

    type: ClassVar[str] = "angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    of: Annotated[BodyName, "the body"]
    value: Annotated[Radians, "the angle [rad]"] = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.of), self.value


@dataclass(frozen=True)
class RelativeAngle(Held):
    """A fixed angle of one body relative to another: they turn together.

        Phi = phi_j - phi_i - value        (1 row)

    Haug (1989), relative constraints.
    """

    type: ClassVar[str] = "relative_angle"
    labels: ClassVar[tuple[str, ...]] = ("angle",)

    name: str
    between: Annotated[BodyPair, "bodies i and j"]
    value: Annotated[Radians, "the angle [rad]"] = 0.0

    def measured(self) -> tuple[AngleBetween, float]:
        return AngleBetween(self.between[1], self.between[0]), self.value
