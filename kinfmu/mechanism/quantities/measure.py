"""Quantities of a pose that a joint can hold, a driver can drive, or a coupling can relate."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.quantities.arithmetic import Value, sqrt
from kinfmu.mechanism.quantities.placement import Axis, BodyName, Placement, PointName, PointPair, Reference, body_of
from kinfmu.units import Radians


class PoseQuantity(ABC):
    """One number of a pose, in plain arithmetic.

    A leaf is a frozen dataclass; its fields are keys of the table that names it, such as
    `{ measure = "angle", of = "rocker" }`. `kind` is 'length' or 'angle'.
    """

    type: ClassVar[str]  # its name in mechanism files
    kind: ClassVar[str]
    is_absolute: ClassVar[bool] = False  # True if it depends on the world's origin
    is_root: ClassVar[bool] = False  # True if it is a square root, with a kink where it is 0

    @property
    def is_angle(self) -> bool:
        """True for an angle [rad]."""
        return self.kind == "angle"

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Return the names of its bodies, ground included."""

    @abstractmethod
    def value(self, at: Placement) -> Value:
        """Return the quantity in a pose."""

    def row(self, at: Placement, target: Value) -> Value:
        """Return a residual that is zero where the quantity is `target`."""
        return self.value(at) - target

    def scale(self, target: float) -> float:  # noqa: ARG002  some rows depend on it
        """Return the change of the row per change of the quantity, where it is `target`."""
        return 1.0

    def gap(self, residual: float, target: float) -> float:
        """Return the difference of the quantity and `target` where the row has this residual."""
        return residual / self.scale(target)


@dataclass(frozen=True)
class AngleBetween(PoseQuantity):
    """Angle of a body relative to another or to the world: phi_of - phi_to, with whole turns."""

    type: ClassVar[str] = "angle"
    kind: ClassVar[str] = "angle"

    of: Annotated[BodyName, "the body"]
    to: Annotated[str | None, Reference("body"), "the reference body; default: the world"] = None

    def bodies(self) -> tuple[str, ...]:
        return (self.of,) if self.to is None else (self.to, self.of)

    def value(self, at: Placement) -> Value:
        return at.angle(self.of) if self.to is None else at.angle(self.of) - at.angle(self.to)


@dataclass(frozen=True)
class CoordinateOf(PoseQuantity):
    """World coordinate of a point."""

    type: ClassVar[str] = "coordinate"
    kind: ClassVar[str] = "length"
    is_absolute: ClassVar[bool] = True

    of: Annotated[PointName, "the point"]
    axis: Annotated[Axis, "'x' or 'y'"]

    def bodies(self) -> tuple[str, ...]:
        return (body_of(self.of),)

    def value(self, at: Placement) -> Value:
        x, y = at.point(self.of)
        return x if self.axis == "x" else y


@dataclass(frozen=True)
class DistanceBetween(PoseQuantity):
    """Distance L = norm(d) of two points.

    The row d.d - L^2 needs no root and is smooth for every d.
    """

    type: ClassVar[str] = "distance"
    kind: ClassVar[str] = "length"
    is_root: ClassVar[bool] = True

    between: Annotated[PointPair, "the two points"]

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def value(self, at: Placement) -> Value:
        return sqrt(self._squared(at))

    def row(self, at: Placement, target: Value) -> Value:
        return self._squared(at) - target * target

    def scale(self, target: float) -> float:
        return 2.0 * target

    def gap(self, residual: float, target: float) -> float:
        return math.sqrt(max(residual + target * target, 0.0)) - target

    def _squared(self, at: Placement) -> Value:
        d_x, d_y = at.vector(self.between)
        return d_x * d_x + d_y * d_y


@dataclass(frozen=True)
class _OnSlide(PoseQuantity):
    """Where a point b lies against an axis through another point a: d = r_b - r_a, and e fixed in a's body."""

    kind: ClassVar[str] = "length"

    between: Annotated[PointPair, "the points a and b"]
    axis: Annotated[Radians, "angle of e in a's body's frame [rad]"] = 0.0

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))


@dataclass(frozen=True)
class PositionAlong(_OnSlide):
    """Position of a point along an axis through another: e.d with d = r_b - r_a and e fixed in a's body."""

    type: ClassVar[str] = "position"

    def value(self, at: Placement) -> Value:
        (a_x, a_y), (b_x, b_y) = map(at.point, self.between)
        e_x, e_y = at.direction(body_of(self.between[0]), self.axis)
        return e_x * (b_x - a_x) + e_y * (b_y - a_y)


@dataclass(frozen=True)
class OffsetFrom(_OnSlide):
    """Distance of a point to the left of an axis through another: n.d with n = e turned by 90 degrees."""

    type: ClassVar[str] = "offset"

    def value(self, at: Placement) -> Value:
        (a_x, a_y), (b_x, b_y) = map(at.point, self.between)
        e_x, e_y = at.direction(body_of(self.between[0]), self.axis)
        return e_x * (b_y - a_y) - e_y * (b_x - a_x)


@dataclass(frozen=True)
class CosineBetween(PoseQuantity):
    """Cosine of the angle between two lines, each from a point to another. It is no quantity of mechanism files."""

    type: ClassVar[str] = "cosine"
    kind: ClassVar[str] = "number"

    first: PointPair
    second: PointPair

    def bodies(self) -> tuple[str, ...]:
        return tuple(map(body_of, (*self.first, *self.second)))

    def value(self, at: Placement) -> Value:
        return cosine_between(at.vector(self.first), at.vector(self.second))


def cosine_between(a: tuple[Value, Value], b: tuple[Value, Value]) -> Value:
    """Return the cosine of the angle between two vectors."""
    (a_x, a_y), (b_x, b_y) = a, b
    return (a_x * b_x + a_y * b_y) / sqrt((a_x * a_x + a_y * a_y) * (b_x * b_x + b_y * b_y))
