"""The plan's own origin: far from the world's origin, the offset of a mechanism costs digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism, Point, Start
from kinfmu.mechanism.quantities.arithmetic import decimal_sum
from kinfmu.plan.equations.system import FAR, System, size_of
from kinfmu.units import CoordinateName


class FarRows(NamedTuple):
    """How the rows of a mechanism are rounded that is tied to the world's origin and far from it.

    offset: how many sizes it is away, 0 for any other mechanism: the numbers in its rows are that much larger than what
    the rows are about. slopes: the largest |slope| of each row over a length, (m,), then 0 too.
    """

    offset: float
    slopes: FloatArray


def localized(mechanism: Mechanism) -> tuple[Mechanism, Point]:
    """Return the mechanism as seen from its own origin, and the place of that origin in the world [length].

    The origin is the first of `ground_points` if the mechanism is far away, else the world's (also if a driver or a law
    prescribes a coordinate in the world). Constraints do not depend on it, and rounding is then relative to the size
    and not to the offset. Points are moved as decimal numbers: the double nearest to 1000000.7 has lost digits.
    """
    first = Point(*next(iter(mechanism.ground_points), (0.0, 0.0)))
    if _is_tied(mechanism) or max(map(abs, first)) <= FAR * size_of(mechanism):
        return mechanism, Point(0.0, 0.0)
    return _moved(mechanism, -first.x, -first.y), first


def far_rows(system: System, q: FloatArray) -> FarRows:
    """Return how rows are rounded in a pose q, (n,), of a mechanism that is far from the origin it is tied to."""
    away = float(np.abs(q.reshape(-1, 3)[:, :2]).max(initial=0.0)) / system.size
    if away <= FAR or not _is_tied(system.mechanism):
        return FarRows(0.0, np.zeros(len(system.rows)))
    is_length = [not name.is_angle for name in system.coordinates]
    slopes = np.abs(system.jacobian(q)[:, is_length]).max(axis=1, initial=0.0)
    return FarRows(float(f"{away:.2g}"), np.asarray(slopes))


def _is_tied(mechanism: Mechanism) -> bool:
    """Return whether a driver, a joint or a load prescribes or measures a coordinate in the world."""
    return (
        any(driver.measured().is_absolute for driver in mechanism.drivers)
        or any(joint.depends_on_origin for joint in mechanism.joints)
        or any(load.depends_on_origin for load in mechanism.loads)
    )


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
