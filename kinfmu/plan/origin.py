"""The plan's own origin: a mechanism far from the world's would lose the digits that its offset takes."""

from __future__ import annotations

from dataclasses import replace

from kinfmu.equations.system import size_of
from kinfmu.measures.decimal_sum import decimal_sum
from kinfmu.mechanism import Mechanism, Point, Start

FAR = 4.0  # sizes from the world's origin beyond which a mechanism is planned about a ground point of its own


def localized(mechanism: Mechanism) -> tuple[Mechanism, Point]:
    """The mechanism as seen from its own origin, and where that lies in the world [length].

    The origin is the first ground point if the mechanism lies far off, else the world's (also where a driver or a law
    leads a coordinate of the world): constraints do not depend on it, and rounding then is relative to the size and not
    to the offset. Points move by decimal numbers: of a pin at 1000000.7 the double beside it has lost what counts.
    """
    ground = next(body for body in mechanism.bodies if body.is_ground)
    first = next(iter(ground.points.values()), Point(0.0, 0.0))
    is_tied = any(driver.measured().is_absolute for driver in mechanism.drivers)
    is_tied = is_tied or any(joint.depends_on_origin for joint in mechanism.joints)
    if is_tied or max(map(abs, first)) <= FAR * size_of(mechanism):
        return mechanism, Point(0.0, 0.0)
    return _moved(mechanism, -first.x, -first.y), first


def _moved(mechanism: Mechanism, dx: float, dy: float) -> Mechanism:
    """The same mechanism elsewhere: ground points, start poses and absolute joints, their expressions too."""
    bodies, written = [], mechanism.with_expressions()
    for body in written.bodies:
        if body.is_ground:
            points = {
                name: Point(decimal_sum(point.x, dx), decimal_sum(point.y, dy)) for name, point in body.points.items()
            }
            bodies.append(replace(body, points=points))
        else:
            x, y, phi = body.start
            start = Start(None if x is None else decimal_sum(x, dx), None if y is None else decimal_sum(y, dy), phi)
            bodies.append(replace(body, start=start))
    joints = tuple(joint.moved(dx, dy) for joint in written.joints)
    return replace(mechanism, bodies=tuple(bodies), joints=joints)
