"""Readings of how motion and force pass through a mechanism: angles of transmission and pressure, ratios."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.measures.reading import Begin, End, Finding, Measured, Motion, Reading
from kinfmu.mechanism.quantities import CosineBetween
from kinfmu.mechanism.quantities.placement import BodyName, PointName, PointPair, Reference, body_of
from kinfmu.units import Quantity, Radians

ANGLE, NUMBER = Quantity("angle"), Quantity("number")
Against = Annotated[str | None, Reference("coordinate"), "the coordinate to compare with; default: the driver"]


@dataclass(frozen=True)
class TransmissionAngle(Reading):
    """Largest deviation of the transmission angle from 90 degrees; a deviation of 90 degrees transmits nothing.

    The transmission angle is the angle between a line of the coupler and a line of the output, such as the lines from
    their common joint to the other joints; of a slide, the line of the output is perpendicular to the slide.
    """

    type: ClassVar[str] = "transmission_angle"
    counted_from: ClassVar[str] = "90 deg"

    name: str
    coupler: Annotated[PointPair, "two points of the coupler's line"]
    output: Annotated[PointPair, "two points of the output's line"]
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        worst = motion.history(self._cosine).largest_size()
        return Finding(motion.arc_sine(worst.value), ANGLE, (worst.x,))

    def quantities(self) -> tuple[CosineBetween, ...]:
        return (self._cosine,)

    @property
    def _cosine(self) -> CosineBetween:
        return CosineBetween(self.coupler, self.output)


@dataclass(frozen=True)
class TransmissionSide(TransmissionAngle):
    """Largest deviation of the transmission angle from 90 degrees to one side: below 90 degrees, signed.

    With the points of `coupler` in reverse order it is the deviation above 90 degrees. The larger of both is that of
    `TransmissionAngle`, but each has derivatives where they are equal. It is no type of mechanism files.
    """

    def read(self, motion: Motion) -> Finding:
        worst = motion.history(self._cosine).maximum()
        return Finding(motion.arc_sine(worst.value), ANGLE, (worst.x,))


@dataclass(frozen=True)
class PressureAngle(Reading):
    """Largest angle between the motion of a cam's follower and the normal of the cam at their contact.

    The centre of the roller (of a knife edge the edge) moves relative to the cam along the tangent of the pitch curve.
    """

    type: ClassVar[str] = "pressure_angle"
    compares_rates: ClassVar[bool] = True

    name: str
    cam: Annotated[BodyName, "the cam"]
    follower: Annotated[PointName, "centre of the roller, or edge, on the follower"]
    pivot: Annotated[str | None, Reference("point"), "pivot of a swinging follower; default: it slides"] = None
    axis: Annotated[Radians, "direction in which a sliding follower moves, in the world [rad]"] = 0.0
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        if self.pivot is None:
            along = motion.direction(self.axis)
        else:
            arm_x, arm_y = motion.vector((self.pivot, self.follower))
            along = -arm_y, arm_x
        worst = motion.cosine(along, motion.velocity_against(self.follower, self.cam)).largest_size()
        return Finding(motion.arc_sine(worst.value), ANGLE, (worst.x,))

    def quantities(self) -> tuple[str, ...]:
        bodies = dict.fromkeys((self.cam, body_of(self.follower), body_of(self.pivot or self.follower)))
        return tuple(f"{body}.{axis}" for body in bodies if body != GROUND_NAME for axis in ("x", "y", "phi"))


@dataclass(frozen=True)
class VelocityRatio(Reading):
    """Extreme of the speed of a quantity over that of another: omega_out / omega_in.

    With one driver it is geometry: the law of the driver may stand still. Where the other one turns back while the
    quantity moves, the ratio has no bound, so that there is no extreme.
    """

    type: ClassVar[str] = "velocity_ratio"
    compares_rates: ClassVar[bool] = True

    name: str
    of: Measured
    to: Against = None
    extreme: Annotated[str, Reference("choice", ("maximum", "minimum")), "'maximum' or 'minimum'"] = "maximum"
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        history = motion.speed_ratio(self.of, self.to)
        found = history.maximum() if self.extreme == "maximum" else history.minimum()
        lacks = () if self.to is None else (motion.at_rest(self.to), motion.unbounded_ratio(self.of, self.to))
        return Finding(found.value, motion.ratio_quantity(self.of, self.to), (found.x,), lacks)


@dataclass(frozen=True)
class MechanicalAdvantage(Reading):
    """Lowest mechanical advantage: force or torque out over in, the inverse of the largest velocity ratio.

    With one driver it is geometry: the law of the driver may stand still. It is 0 where the other quantity turns back
    while the first one moves.
    """

    type: ClassVar[str] = "mechanical_advantage"
    compares_rates: ClassVar[bool] = True

    name: str
    of: Measured
    to: Against = None
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        fastest = motion.largest_ratio(self.of, self.to)
        lacks = [motion.at_rest(one) for one in (self.of, self.to) if one is not None]
        value = motion.ratio(1.0, fastest.value)
        return Finding(value, motion.ratio_quantity(self.of, self.to, inverse=True), (fastest.x,), tuple(lacks))
