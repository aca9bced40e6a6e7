"""Loads along the line between two points, or the angle between two bodies: springs, dampers, gas springs, forces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.loads.load import Following, Load, Over
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import BodyPair, Placement, PointPair, body_of
from kinfmu.units import METRES, Damping, Force, Length, Radians, Stiffness, TorsionalDamping, TorsionalStiffness

Points = Annotated[PointPair, "the two points 'body.point'"]
MEET = 1e-9  # of the distance of the points from their bodies' origins; nearer points have no line between them


class AlongLine(Load):
    """A load along the line between two points; its quantity is their distance.

    s = |d|,   d = r_j + A_j s_b - r_i - A_i s_a
    """

    between: tuple[str, str]

    @property
    def needs_direction(self) -> bool:
        return True

    def acts_on(self) -> tuple[str, ...]:
        return tuple(map(body_of, self.between))

    def measured(self, at: Placement) -> tuple[Value, ...]:
        return (DistanceBetween(self.between).value(at),)

    def kinds(self) -> tuple[str, ...]:
        return ("length",)

    def check_start(self, at: Placement) -> None:
        d_x, d_y = at.vector(self.between)
        first, second = self.between
        largest = max(abs(one) for point in self.between for one in (*at.points[point], *at.point(point)))
        if math.hypot(d_x, d_y) <= MEET * largest:
            raise MechanismError(
                f"[loads.{self.name}] between: {first} and {second} are in the same place at the start, so the force "
                f"has no direction; move a point or the start pose",
                load=self.name,
            )


class BetweenPoints(AlongLine):
    """A spring or a damper along the line between two points, whose force and length are results."""

    columns: ClassVar[tuple[str, ...]] = ("force", "length")

    def bodies(self) -> tuple[str, ...]:
        return self.acts_on()


@dataclass(frozen=True)
class Spring(BetweenPoints):
    """A linear spring between two points.

        e = -(preload + stiffness (s - free_length))   along   s = |d|,   d = r_j + A_j s_b - r_i - A_i s_a

    It pulls if it is longer than the free length and pushes if it is shorter. Where its ends meet it has no direction,
    unless `free_length` is written as 0, without `preload`: then its force is -stiffness d, at every d.
    """

    type: ClassVar[str] = "spring"
    required: ClassVar[Mapping[str, str]] = {"stiffness": "0 or more", "free_length": "0 or more"}

    name: str
    between: Points
    stiffness: Annotated[Stiffness, "[N/m]"]
    free_length: Annotated[Length, "length without force, or with `preload` [length]"]
    preload: Annotated[Force, "tension at the free length, as wound into extension springs [N]"] = 0.0
    metre: float = field(default=1.0, repr=False, compare=False, metadata={"internal": True})  # unit of length [m]

    @property
    def is_proportional(self) -> bool:
        """True if its force is proportional to d, so that it needs no direction; then s are the components of d."""
        return all(
            isinstance(value, float | int) and value == 0.0 and not hasattr(value, "expression")
            for value in (self.free_length, self.preload)
        )

    @property
    def needs_direction(self) -> bool:
        return not self.is_proportional

    def with_unit(self, length_unit: str) -> Spring:
        return replace(self, metre=METRES[length_unit])

    def measured(self, at: Placement) -> tuple[Value, ...]:
        return at.vector(self.between) if self.is_proportional else super().measured(at)

    def kinds(self) -> tuple[str, ...]:
        return ("length", "length") if self.is_proportional else super().kinds()

    def check_start(self, at: Placement) -> None:
        if not self.is_proportional:
            super().check_start(at)

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        if self.is_proportional:
            return tuple(-(self.stiffness * one) for one in s)
        return (-(self.preload + self.stiffness * self._extension(s)),)

    def energy(self, s: Sequence[Value]) -> Value:
        if self.is_proportional:
            d_x, d_y = s
            return 0.5 * self.stiffness * (d_x * d_x + d_y * d_y)
        extension = self._extension(s)
        return (self.preload + 0.5 * self.stiffness * extension) * extension

    def _extension(self, s: Sequence[Value]) -> Value:
        return s[0] - self.free_length * self.metre


@dataclass(frozen=True)
class Damper(BetweenPoints):
    """A linear damper between two points.

        e = -damping ds/dt   along   s = |d|,   d = r_j + A_j s_b - r_i - A_i s_a

    It resists the change of the distance.
    """

    type: ClassVar[str] = "damper"
    required: ClassVar[Mapping[str, str]] = {"damping": "0 or more"}

    name: str
    between: Points
    damping: Annotated[Damping, "[N s/m]"]

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        return (-(self.damping * sd[0]),)


@dataclass(frozen=True)
class GasSpring(BetweenPoints):
    """A gas spring between two points: it pushes with a force that grows linearly over its stroke.

        e = extended_force + (compressed_force - extended_force) (extended_length - s) / stroke   along   s = |d|

    The forces are those of data sheets (F1 and F2, without friction). End stops and damping are not part of it.
    """

    type: ClassVar[str] = "gas_spring"
    required: ClassVar[Mapping[str, str]] = dict.fromkeys(("extended_length", "stroke", "extended_force"), "positive")

    name: str
    between: Points
    extended_length: Annotated[Length, "distance of its ends where it is extended [length]"]
    stroke: Annotated[Length, "by how much it can be compressed [length]"]
    extended_force: Annotated[Force, "force where it is extended, F1 of data sheets [N]"]
    compressed_force: Annotated[Force, "force where it is compressed by the stroke, F2 of data sheets [N]"]
    metre: float = field(default=1.0, repr=False, compare=False, metadata={"internal": True})  # unit of length [m]

    def with_unit(self, length_unit: str) -> GasSpring:
        return replace(self, metre=METRES[length_unit])

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        return (self.extended_force + self._stiffness() * self._compression(s),)

    def energy(self, s: Sequence[Value]) -> Value:
        compression = self._compression(s)
        return (self.extended_force + 0.5 * self._stiffness() * compression) * compression

    def _compression(self, s: Sequence[Value]) -> Value:
        return self.extended_length * self.metre - s[0]

    def _stiffness(self) -> Value:
        return (self.compressed_force - self.extended_force) / (self.stroke * self.metre)

    def check(self) -> None:
        super().check()
        for low, high in (("stroke", "extended_length"), ("extended_force", "compressed_force")):
            a, b = float(getattr(self, low)), float(getattr(self, high))
            if a > b:
                raise MechanismError(f"[loads.{self.name}] {low} = {a!r} must not be above {high} = {b!r}")


@dataclass(frozen=True)
class ForceBetween(AlongLine, Following):
    """A force between two points along their line, by a law or an input; positive pushes them apart.

        e = f(x)   along   s = |d|,   d = r_j + A_j s_b - r_i - A_i s_a

    Each point takes the force with the opposite sign of the other.
    """

    type: ClassVar[str] = "force_between"

    name: str
    between: Points
    law: Annotated[Law, "the force f [N]"]
    over: Over = None


Bodies = Annotated[BodyPair, "bodies i and j"]


class BetweenBodies(Load):
    """A load along the angle between two bodies.

        s = phi_j - phi_i

    Leaves are torsion springs and dampers.
    """

    columns: ClassVar[tuple[str, ...]] = ("torque", "angle")
    between: tuple[str, str]

    def bodies(self) -> tuple[str, ...]:
        return self.between

    def acts_on(self) -> tuple[str, ...]:
        return self.between

    def measured(self, at: Placement) -> tuple[Value, ...]:
        return (AngleBetween(self.between[1], self.between[0]).value(at),)

    def kinds(self) -> tuple[str, ...]:
        return ("angle",)


@dataclass(frozen=True)
class TorsionSpring(BetweenBodies):
    """A linear torsion spring between two bodies.

        e = -stiffness (s - free_angle)   along   s = phi_j - phi_i

    Whole turns count.
    """

    type: ClassVar[str] = "torsion_spring"
    required: ClassVar[Mapping[str, str]] = {"stiffness": "0 or more"}

    name: str
    between: Bodies
    stiffness: Annotated[TorsionalStiffness, "[N m/rad]"]
    free_angle: Annotated[Radians, "angle without torque [rad]"] = 0.0

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        return (-(self.stiffness * (s[0] - self.free_angle)),)

    def energy(self, s: Sequence[Value]) -> Value:
        turn = s[0] - self.free_angle
        return 0.5 * self.stiffness * turn * turn


@dataclass(frozen=True)
class TorsionDamper(BetweenBodies):
    """A linear torsion damper between two bodies.

        e = -damping ds/dt   along   s = phi_j - phi_i

    It resists the relative speed.
    """

    type: ClassVar[str] = "torsion_damper"
    required: ClassVar[Mapping[str, str]] = {"damping": "0 or more"}

    name: str
    between: Bodies
    damping: Annotated[TorsionalDamping, "[N m s/rad]"]

    def efforts(self, at: Placement, s: Sequence[Value], sd: Sequence[Value], x: Value) -> tuple[Value, ...]:  # noqa: ARG002
        return (-(self.damping * sd[0]),)
