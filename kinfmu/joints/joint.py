"""The contract of a joint: one formula, everything else follows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Annotated, ClassVar, NamedTuple

from kinfmu.joints.arithmetic import Value, cos, sin


class Reference(NamedTuple):
    """What a text field of a joint refers to, so that the reader can check it and say what would be valid."""

    kind: str  # "point": 'body.point', "body": a body's name, or "choice"
    choices: tuple[str, ...] = ()


PointName = Annotated[str, Reference("point")]
BodyName = Annotated[str, Reference("body")]
PointPair = Annotated[tuple[str, str], Reference("point")]
Axis = Annotated[str, Reference("choice", ("x", "y"))]


class Pose(NamedTuple):
    """Where a body is: frame origin (x, y) [length], angle phi [rad], and c = cos phi, s = sin phi."""

    x: Value
    y: Value
    phi: Value
    c: Value
    s: Value

    @classmethod
    def of(cls, x: Value, y: Value, phi: Value) -> Pose:
        return cls(x, y, phi, cos(phi), sin(phi))


GROUND = Pose(0.0, 0.0, 0.0, 1.0, 0.0)


class Placement:
    """The bodies in one pose of the mechanism; answers what joints ask of it, in any arithmetic.

    poses: Pose by body name; points: body-fixed coordinates (s_x, s_y) by 'body.point'.
    """

    def __init__(self, poses: Mapping[str, Pose], points: Mapping[str, tuple[float, float]]) -> None:
        self.poses = poses
        self.points = points

    def point(self, name: str) -> tuple[Value, Value]:
        """World coordinates r + A s of 'body.point'."""
        body = self.poses[name.partition(".")[0]]
        s_x, s_y = self.points[name]
        return body.x + body.c * s_x - body.s * s_y, body.y + body.s * s_x + body.c * s_y

    def angle(self, body: str) -> Value:
        """Angle phi of a body [rad]."""
        return self.poses[body].phi


class Joint(ABC):
    """Constraint rows Phi(q) = 0 between bodies.

    A leaf is a frozen dataclass whose first field is `name`; its other fields are the keys of its table in a mechanism
    file, and their annotations say how the reader checks them. `residual` is plain arithmetic without branches on
    values, so that one formula serves direct evaluation, derivative tests, arrays and generated code.
    """

    type: ClassVar[str]  # how mechanism files call it
    labels: ClassVar[tuple[str, ...]]  # one word a row, such as "x"
    name: str

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that the rows touch, ground included."""

    @abstractmethod
    def residual(self, at: Placement) -> tuple[Value, ...]:
        """Phi, one value a row; zero where the joint holds."""

    def moved(self, dx: float, dy: float) -> Joint:  # noqa: ARG002  absolute joints depend on it
        """The joint when the whole mechanism stands elsewhere; the same unless it is absolute."""
        return self

    def scales(self) -> tuple[float, ...]:
        """Residual per unit of length, one a row: |residual| / scale is the gap as a length, to first order."""
        return (1.0,) * len(self.labels)

    def gaps(self, residual: tuple[float, ...]) -> tuple[float, ...]:
        """By how much each row is open, as a length."""
        return tuple(r / scale for r, scale in zip(residual, self.scales(), strict=True))


def body_of(point: str) -> str:
    """'crank' of 'crank.tip'."""
    return point.partition(".")[0]
