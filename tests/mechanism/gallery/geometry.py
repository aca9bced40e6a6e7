"""Plane geometry on power series in time: the building blocks of closed forms of linkages.

Numbers are the decimal numbers they are written as: 0.1 is a tenth, not the nearest double.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.power_series import Series, atan2, mp, sin_cos, sqrt

Quantity = Any  # a Series, or a number that stays as it is

LEFT, RIGHT = 1, -1  # of the line from the first centre to the second


def decimal(value: Quantity) -> Quantity:
    """Return a literal as the decimal number it is written as."""
    return mp.mpf(repr(value)) if isinstance(value, float) else value


def degrees(value: Quantity) -> Quantity:
    """Convert an angle from degrees to radians."""
    return decimal(value) * mp.pi / 180


@dataclass(frozen=True)
class Vector:
    """A point of the plane, or the vector between two; its coordinates are series or numbers."""

    x: Quantity
    y: Quantity

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", decimal(self.x))
        object.__setattr__(self, "y", decimal(self.y))

    def __add__(self, other: Vector) -> Vector:
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y)

    def __mul__(self, factor: Quantity) -> Vector:
        return Vector(self.x * decimal(factor), self.y * decimal(factor))

    def dot(self, other: Vector) -> Quantity:
        """The scalar product."""
        return self.x * other.x + self.y * other.y


def turned(phi: Quantity, x: Quantity, y: Quantity = 0) -> Vector:
    """(x, y) of a frame at angle phi: (x cos phi - y sin phi, x sin phi + y cos phi)."""
    s, c = sin_cos(phi) if isinstance(phi, Series) else (mp.sin(phi), mp.cos(phi))
    x, y = decimal(x), decimal(y)
    return Vector(c * x - s * y, s * x + c * y)


def meet(a: Vector, radius_a: Quantity, b: Vector, radius_b: Quantity, side: int) -> Vector:
    """Where the circles about a and b meet: LEFT or RIGHT of the line from a to b.

    d = b - a,   e = (radius_a^2 - radius_b^2 + d.d) / (2 d.d),   h^2 = radius_a^2 / d.d - e^2
    meet = a + e d + side h (d turned left)
    """
    radius_a, radius_b = decimal(radius_a), decimal(radius_b)
    d = b - a
    squared = d.dot(d)
    along = (radius_a * radius_a - radius_b * radius_b + squared) / (squared * 2)
    across = sqrt(radius_a * radius_a / squared - along * along) * side
    return a + Vector(along * d.x - across * d.y, along * d.y + across * d.x)


def heading(way: Vector, near: Quantity) -> Series:
    """Return the angle of a vector, with the number of turns that brings it nearest to `near` [rad]."""
    angle = atan2(way.y, way.x)
    wanted = near.c[0] if isinstance(near, Series) else near
    return angle + 2 * mp.pi * mp.nint((wanted - angle.c[0]) / (2 * mp.pi))
