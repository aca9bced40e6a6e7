"""Loads along the angle between two bodies: torsion springs and dampers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.loads.load import Load
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import BodyPair, Placement
from kinfmu.units import Radians, TorsionalDamping, TorsionalStiffness

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
    is_conservative: ClassVar[bool] = True
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
