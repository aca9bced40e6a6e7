"""Mass, centre of mass and moment of inertia of uniform bodies: rods, bars and plates, in any arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

from kinfmu.mechanism.quantities.arithmetic import Value, sqrt

FLAT = 1e-12  # area of corners on a line, of the square of their distance


class MassProperties(NamedTuple):
    """Mass [kg], centre of mass (x, y) in the body's frame [length], moment of inertia about it [kg m2]."""

    mass: Value
    x: Value
    y: Value
    inertia: Value


Place = Sequence[Value]  # (x, y) in the body's frame [length]


def bar(ends: Sequence[Place], width: Value, mass: Value, per_area: Value, metre: float) -> MassProperties:
    """Return a uniform bar, a rectangle around the line between two points that ends at them; a rod has no width.

        m = mass + per_area L w,   I = m (L^2 + w^2) / 12

    Args:
        ends: The two points.
        width: Its width w [length].
        mass: Its mass [kg], or 0 with a mass by area.
        per_area: Mass by area [kg/m2], or 0 with a mass.
        metre: Unit of length [m].

    """
    (a_x, a_y), (b_x, b_y) = ends
    d_x, d_y, square_metre = b_x - a_x, b_y - a_y, metre * metre
    square = d_x * d_x + d_y * d_y
    total = mass + per_area * width * sqrt(square) * square_metre
    inertia = total * (square + width * width) * (square_metre / 12.0)
    return MassProperties(total, 0.5 * (a_x + b_x), 0.5 * (a_y + b_y), inertia)


def plate(corners: Sequence[Place], mass: Value, per_area: Value, metre: float) -> MassProperties:
    """Return a uniform plate with straight edges, by Green's theorem, seen from its first corner:

        2 A = sum c_k,   c_k = x_k y_k+1 - x_k+1 y_k,   6 A x_C = sum c_k (x_k + x_k+1)
        12 A I / m = sum c_k (x_k^2 + x_k x_k+1 + x_k+1^2 + y_k^2 + y_k y_k+1 + y_k+1^2) - 12 A |r_C|^2

    Args:
        corners: Its corners, in either direction.
        mass: Its mass [kg], or 0 with a mass by area.
        per_area: Mass by area [kg/m2], or 0 with a mass.
        metre: Unit of length [m].

    """
    (x_0, y_0), *others = corners
    seen = [(x - x_0, y - y_0) for x, y in others]  # edges at the first corner add nothing
    area = moment_x = moment_y = turning = 0.0  # type: Value
    for (a_x, a_y), (b_x, b_y) in pairwise(seen):
        cross = a_x * b_y - b_x * a_y
        area = area + cross
        moment_x, moment_y = moment_x + cross * (a_x + b_x), moment_y + cross * (a_y + b_y)
        turning = turning + cross * (a_x * a_x + a_x * b_x + b_x * b_x + a_y * a_y + a_y * b_y + b_y * b_y)
    c_x, c_y = moment_x / (3.0 * area), moment_y / (3.0 * area)
    total = mass + per_area * sqrt(area * area) * (0.5 * metre * metre)
    inertia = total * (turning / (6.0 * area) - (c_x * c_x + c_y * c_y)) * (metre * metre)
    return MassProperties(total, x_0 + c_x, y_0 + c_y, inertia)


def has_area(corners: Sequence[tuple[float, float]]) -> bool:
    """Return True if corners do not lie on one line, to round-off."""
    (x_0, y_0), *others = corners
    seen = [(x - x_0, y - y_0) for x, y in others]
    area = sum(a_x * b_y - b_x * a_y for (a_x, a_y), (b_x, b_y) in pairwise(seen))
    return abs(area) > FLAT * max(x * x + y * y for x, y in seen)


def crossing(corners: Sequence[tuple[float, float]]) -> tuple[int, int] | None:
    """Return the first corners of two edges of a plate that cross or touch; None if there are none."""
    count = len(corners)
    edges = [(corners[k], corners[(k + 1) % count]) for k in range(count)]

    def side(a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]) -> float:
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    for i, j in combinations(range(count), 2):
        if j - i in (1, count - 1):
            continue  # neighbours share a corner
        (a, b), (c, d) = edges[i], edges[j]
        if side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0:
            return i, j
    return None
