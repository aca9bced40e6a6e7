"""Drivers: constraint rows whose target follows a law, one class for each quantity that can be driven.

To add one, write its class and add it to `DRIVERS`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from kinfmu.mechanism.laws import ConstantSpeed, Law
from kinfmu.mechanism.laws.law import TURN
from kinfmu.mechanism.quantities import AngleBetween, CoordinateOf, DistanceBetween, PoseQuantity, PositionAlong
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Axis, BodyName, BodyPair, Placement, PointName, PointPair
from kinfmu.units import InputName, Quantity, Radians

SAMPLES_PER_TURN = 360  # of a run that shows one cycle


class Driver(ABC):
    """One driving row Phi(q, t): a measured quantity follows u(t).

        Phi = quantity - u(t)        (1 row; a quantity may define its own row)

    A leaf is a frozen dataclass with fields `name`, its own keys, and last `law`. `noun` names the input of an FMU:
    a driver `crank` with noun `angle` has the inputs `crank_angle`, `crank_speed` and `crank_acceleration`.
    """

    type: ClassVar[str]
    noun: ClassVar[str]
    name: str
    law: Law

    @abstractmethod
    def measured(self) -> PoseQuantity:
        """Return the driven quantity."""

    def bodies(self) -> tuple[str, ...]:
        """Return the names of the bodies in the row, ground included."""
        return self.measured().bodies()

    def residual(self, at: Placement, target: Value) -> Value:
        """Return Phi of the driving row for a target u."""
        return self.measured().row(at, target)

    @property
    def quantity(self) -> Quantity:
        """What is driven, a length or an angle."""
        return Quantity(self.measured().kind)

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.quantity.kind, "time"

    @property
    def cycle(self) -> float:
        """Time [s] of one turn at constant speed, or of one period of the law; 0 if the driver does not repeat."""
        if isinstance(self.law, ConstantSpeed) and self.quantity.kind == "angle" and self.law.speed:
            return TURN / abs(self.law.speed)
        return self.law.period

    def check(self) -> None:
        """Raise a MechanismError for invalid values; numbers are finite and references valid by then."""
        self.law.check(f"[drivers.{self.name}]")

    def inputs(self) -> tuple[InputName, InputName, InputName]:
        """Return the names of the inputs for value, speed and acceleration."""
        value = InputName(self.name, self.noun)
        return value, value.derivative(1), value.derivative(2)


@dataclass(frozen=True)
class AngleDriver(Driver):
    """A driven angle of a body: a crank turned by a motor on the ground.

        Phi = phi_i - u(t)        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "angle"
    noun: ClassVar[str] = "angle"

    name: str
    of: Annotated[BodyName, "the body"]
    law: Annotated[Law, "u(t) [rad]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> AngleBetween:
        return AngleBetween(self.of)


@dataclass(frozen=True)
class RelativeAngleDriver(Driver):
    """A driven angle of one body relative to another: a motor in a joint between moving bodies.

        Phi = phi_j - phi_i - u(t)        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "relative_angle"
    noun: ClassVar[str] = "angle"

    name: str
    between: Annotated[BodyPair, "bodies i and j"]
    law: Annotated[Law, "u(t) [rad]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> AngleBetween:
        return AngleBetween(self.between[1], self.between[0])


@dataclass(frozen=True)
class CoordinateDriver(Driver):
    """A driven world coordinate of a point.

        Phi = (r_i + A_i s_a)_x - u(t)     or the same with y        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "coordinate"
    noun: ClassVar[str] = "position"

    name: str
    of: Annotated[PointName, "the point"]
    axis: Annotated[Axis, "'x' or 'y'"]
    law: Annotated[Law, "u(t) [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> CoordinateOf:
        return CoordinateOf(self.of, self.axis)


@dataclass(frozen=True)
class SlideDriver(Driver):
    """A driven position along a slide: a linear actuator.

        Phi = e.d - u(t),   d = r_j + A_j s_b - r_i - A_i s_a        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "slide"
    noun: ClassVar[str] = "position"

    name: str
    between: Annotated[PointPair, "a point of the slide on body i, then the moved point of body j"]
    axis: Annotated[Radians, "direction e in i's frame [rad]"] = 0.0
    law: Annotated[Law, "u(t) [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> PositionAlong:
        return PositionAlong(self.between, self.axis)


@dataclass(frozen=True)
class DistanceDriver(Driver):
    """A driven distance of two points: a cylinder between two bodies.

        Phi = d.d - u(t)^2,   d = r_j + A_j s_b - r_i - A_i s_a        (1 row)

    Haug (1989), driving constraints.
    """

    type: ClassVar[str] = "distance"
    noun: ClassVar[str] = "length"

    name: str
    between: Annotated[PointPair, "the two points"]
    law: Annotated[Law, "u(t) > 0 [length]"] = field(default_factory=ConstantSpeed)

    def measured(self) -> DistanceBetween:
        return DistanceBetween(self.between)


DRIVERS: tuple[type[Driver], ...] = (
    AngleDriver,
    RelativeAngleDriver,
    CoordinateDriver,
    SlideDriver,
    DistanceDriver,
)
