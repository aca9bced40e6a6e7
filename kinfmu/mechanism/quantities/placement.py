"""The poses of the bodies as joints see them, and the references in text fields of joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, NamedTuple

from kinfmu.mechanism.quantities.arithmetic import Value, cos, sin


class Reference(NamedTuple):
    """What a text field of a joint refers to, so that the reader can check it."""

    kind: str  # "point": 'body.point', "body": a body's name, or "choice"
    choices: tuple[str, ...] = ()


PointName = Annotated[str, Reference("point")]
BodyName = Annotated[str, Reference("body")]
PointPair = Annotated[tuple[str, str], Reference("point")]
BodyPair = Annotated[tuple[str, str], Reference("body")]
Axis = Annotated[str, Reference("choice", ("x", "y"))]


class BodyFrame(NamedTuple):
    """The frame of a body in the world: origin (x, y) [length], angle phi [rad], and c = cos phi, s = sin phi."""

    x: Value
    y: Value
    phi: Value
    c: Value
    s: Value

    @classmethod
    def of(cls, x: Value, y: Value, phi: Value) -> BodyFrame:
        return cls(x, y, phi, cos(phi), sin(phi))


GROUND = BodyFrame(0.0, 0.0, 0.0, 1.0, 0.0)


class Placement:
    """The bodies in one pose of the mechanism, in any arithmetic.

    poses: BodyFrame by body name. points: Body-fixed coordinates (s_x, s_y) by 'body.point'.
    """

    def __init__(self, poses: Mapping[str, BodyFrame], points: Mapping[str, tuple[float, float]]) -> None:
        self.poses = poses
        self.points = points

    def point(self, name: str) -> tuple[Value, Value]:
        """Return the world coordinates r + A s of 'body.point'."""
        body = self.poses[body_of(name)]
        s_x, s_y = self.points[name]
        return body.x + body.c * s_x - body.s * s_y, body.y + body.s * s_x + body.c * s_y

    def vector(self, between: tuple[str, str]) -> tuple[Value, Value]:
        """Return the world coordinates of the vector from the first point to the second."""
        (a_x, a_y), (b_x, b_y) = map(self.point, between)
        return b_x - a_x, b_y - a_y

    def angle(self, body: str) -> Value:
        """Return the angle phi of a body [rad]."""
        return self.poses[body].phi

    def direction(self, body: str, angle: Value) -> tuple[Value, Value]:
        """Return the unit vector at an angle [rad] to the x axis of a body's frame, in world coordinates."""
        pose = self.poses[body]
        e_x, e_y = unit_vector(angle)
        return pose.c * e_x - pose.s * e_y, pose.s * e_x + pose.c * e_y


def unit_vector(angle: Value) -> tuple[Value, Value]:
    """Return (cos, sin) of an angle [rad], exact for numbers that are multiples of pi/2."""
    if not isinstance(angle, float | int):
        return cos(angle), sin(angle)
    quarter = angle / (0.5 * math.pi)
    if quarter == round(quarter):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    return math.cos(angle), math.sin(angle)


def body_of(point: str) -> str:
    """Return 'crank' of 'crank.tip'."""
    return point.partition(".")[0]


def point_of(point: str) -> str:
    """Return 'tip' of 'crank.tip'."""
    return point.partition(".")[2]
