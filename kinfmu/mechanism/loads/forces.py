"""Forces at a point, and torques on a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.loads.load import Following, Load, Over
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import BodyName, Placement, PointName, body_of
from kinfmu.units import Force, Radians

Axes = Annotated[BodyName, "the body with which the direction turns; ground: it is fixed in the world"]


class AtPoint(Load):
    """A force at a point: its quantities are the point's coordinates."""

    at: str

    def acts_on(self) -> tuple[str, ...]:
        return (body_of(self.at),)

    def measured(self, at: Placement) -> tuple[Value, ...]:
        return at.point(self.at)

    def kinds(self) -> tuple[str, ...]:
        return "length", "length"


@dataclass(frozen=True)
class ForceAt(AtPoint):
    """A constant force at a point, such as a weight.

        e = A_k (f_x, f_y)   along   s = r_i + A_i s_a        (k: the body of `axes`)

    The direction turns with the body of `axes`.
    """

    type: ClassVar[str] = "force"

    name: str
    at: Annotated[PointName, "the point 'body.point'"]
    x: Annotated[Force, "component f_x [N]"] = 0.0
    y: Annotated[Force, "component f_y [N]"] = 0.0
    axes: Axes = "ground"

    def bodies(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((body_of(self.at), self.axes)))

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        frame = at.poses[self.axes]
        return frame.c * self.x - frame.s * self.y, frame.s * self.x + frame.c * self.y


@dataclass(frozen=True)
class ForceAlong(AtPoint, Following):
    """A force at a point along a direction, by a law or an input: the gas force on a piston.

        e = f(x) (cos(phi_k + angle), sin(phi_k + angle))   along   s = r_i + A_i s_a        (k: the body of `axes`)

    The direction turns with the body of `axes`; in the world it is fixed.
    """

    type: ClassVar[str] = "force_along"

    name: str
    at: Annotated[PointName, "the point 'body.point'"]
    law: Annotated[Law, "the force f [N]"]
    angle: Annotated[Radians, "direction of the force [rad]"] = 0.0
    axes: Axes = "ground"
    over: Over = None

    def frames(self) -> tuple[str, ...]:
        return (self.axes,)

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        force = self.effort(x)
        e_x, e_y = at.direction(self.axes, self.angle)
        return force * e_x, force * e_y


@dataclass(frozen=True)
class TorqueOn(Following):
    """A torque on a body, with its reaction on another or on the ground, by a law or an input.

        e = f(x)   along   s = phi_j - phi_i

    Positive torques turn body j counter-clockwise against body i.
    """

    type: ClassVar[str] = "torque"

    name: str
    on: Annotated[BodyName, "body j"]
    law: Annotated[Law, "the torque f [N m]"]
    against: Annotated[BodyName, "body i, which takes the reaction"] = "ground"
    over: Over = None

    def acts_on(self) -> tuple[str, ...]:
        return self.against, self.on

    def measured(self, at: Placement) -> tuple[Value, ...]:
        return (AngleBetween(self.on, self.against).value(at),)

    def kinds(self) -> tuple[str, ...]:
        return ("angle",)
