"""The plan's own origin: far from the world's origin, the offset of a mechanism costs digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kinfmu.equations.system import FloatArray, size_of
from kinfmu.measures.arithmetic import decimal_sum
from kinfmu.mechanism import Mechanism, Point, Start
from kinfmu.units import CoordinateName

FAR = 4.0  # sizes from the world's origin beyond which a mechanism is planned about a ground point of its own


def localized(mechanism: Mechanism) -> tuple[Mechanism, Point]:
    """Return the mechanism as seen from its own origin, and the place of that origin in the world [length].

    The origin is the first of `ground_points` if the mechanism is far away, else the world's (also if a driver or a law
    prescribes a coordinate in the world). Constraints do not depend on it, and rounding is then relative to the size
    and not to the offset. Points are moved as decimal numbers: the double nearest to 1000000.7 has lost digits.
    """
    first = Point(*next(iter(mechanism.ground_points), (0.0, 0.0)))
    is_tied = any(driver.measured().is_absolute for driver in mechanism.drivers)
    is_tied = is_tied or any(joint.depends_on_origin for joint in mechanism.joints)
    is_tied = is_tied or any(load.depends_on_origin for load in mechanism.loads)
    if is_tied or max(map(abs, first)) <= FAR * size_of(mechanism):
        return mechanism, Point(0.0, 0.0)
    return _moved(mechanism, -first.x, -first.y), first


def relative_to(origin: Point, names: Sequence[CoordinateName], values: Mapping[str, float]) -> FloatArray:
    """Return coordinates as seen from an origin, in the order of their names; values: in the world, by name."""
    offset = {"x": origin.x, "y": origin.y, "phi": 0.0}
    return np.array([values[name] - offset[name.axis] for name in names])


def in_world(origin: Point, q: FloatArray) -> FloatArray:
    """Return all coordinates of a mechanism in the world; q: (n,) as seen from the origin."""
    return np.asarray(q + np.tile([origin.x, origin.y, 0.0], len(q) // 3))


def _moved(mechanism: Mechanism, dx: float, dy: float) -> Mechanism:
    """Return the mechanism at another place: ground points, start poses and absolute joints, with their expressions."""
    bodies, source = [], mechanism.with_expressions()
    for body in source.bodies:
        if body.is_ground:
            points = {
                name: Point(decimal_sum(point.x, dx), decimal_sum(point.y, dy)) for name, point in body.points.items()
            }
            bodies.append(replace(body, points=points))
        else:
            x, y, phi = body.start
            start = Start(None if x is None else decimal_sum(x, dx), None if y is None else decimal_sum(y, dy), phi)
            bodies.append(replace(body, start=start))
    joints = tuple(joint.moved(dx, dy) for joint in source.joints)
    return replace(mechanism, bodies=tuple(bodies), joints=joints)
