"""The contract of cams with a lift law: a follower whose position depends on the angle of a cam."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from kinfmu.errors import MechanismError
from kinfmu.joints.joint import Condition, Joint
from kinfmu.laws import Law
from kinfmu.laws.law import TURN
from kinfmu.measures import AngleBetween, Measure
from kinfmu.measures.arithmetic import Value
from kinfmu.measures.placement import Placement

_SAMPLES = 24  # angles in a turn at which the size of a lift is sampled


class Cam(Joint):
    """A cam and follower: a measure of the follower depends on the cam's angle relative to the body that holds both.

        Phi = measure - offset - f(phi_k - phi_i)        (1 row, scale 1)

    A leaf defines the bodies and the measure of the follower.
    """

    cam: str
    law: Law
    offset: float
    led: ClassVar[str]  # 'length' or 'angle': what the lift is

    def holder(self) -> str:
        """Return body i, which holds the cam's axle and the follower's guide or pivot."""
        return self.bodies()[0]

    @abstractmethod
    def follower(self) -> Measure:
        """Return the measure of the follower."""

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.led, "angle"

    def residual(self, at: Placement) -> tuple[Value, ...]:
        turn = AngleBetween(self.cam, self.holder()).value(at)
        return (self.follower().value(at) - self.offset - self.law.at(turn),)

    def kinds(self) -> tuple[str, ...]:
        return (self.led,)

    def reach(self) -> float:
        lifts = [abs(self.offset + self.law.at(k * TURN / _SAMPLES)) for k in range(_SAMPLES)]
        return max(lifts) if self.led == "length" else 0.0

    def conditions(self) -> tuple[Condition, ...]:
        return closing(self.law) if self.law.repeats else ()

    def check(self) -> None:
        where = f"[joints.{self.name}]"
        self.law.check(where)
        if self.cam in self.bodies()[:2]:
            raise MechanismError(
                f"{where} cam = '{self.cam}' must be another body than the follower and what holds it", joint=self.name
            )
        why = self.law.why_not_periodic() if self.law.repeats else ""
        if why:
            raise MechanismError(
                f"{where} law: {why}; a follower that goes on turn after turn needs a coupling", joint=self.name
            )


def closing(law: Law) -> tuple[Condition, ...]:
    """Return the conditions for a law of an angle to be periodic over a turn."""
    return tuple(Condition(f"law: {key}", value, "0") for key, value in law.zeros().items())
