"""Readings of one quantity: extremes, range, peaks, rests; of the path of a point: its shape; the lowest margin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import LawQuantity
from kinfmu.mechanism.measures.reading import Begin, End, Finding, Measured, Motion, Reading
from kinfmu.mechanism.quantities.placement import PointName, Reference
from kinfmu.units import Quantity


@dataclass(frozen=True)
class _OfQuantity(Reading):
    """A number of one quantity over a part of the motion."""

    name: str
    of: Measured
    begin: Begin = None
    end: End = None


@dataclass(frozen=True)
class Minimum(_OfQuantity):
    """The smallest value of a quantity."""

    type: ClassVar[str] = "minimum"
    reads_forces: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        low = motion.history(self.of).minimum()
        return Finding(low.value, motion.quantity(self.of), (low.x,))


@dataclass(frozen=True)
class Maximum(_OfQuantity):
    """The largest value of a quantity."""

    type: ClassVar[str] = "maximum"
    reads_forces: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        high = motion.history(self.of).maximum()
        return Finding(high.value, motion.quantity(self.of), (high.x,))


@dataclass(frozen=True)
class Range(_OfQuantity):
    """The largest value minus the smallest: the stroke of a slide, the swing angle of a rocker.

    It occurs at two values of the driver: of the smallest and of the largest value.
    """

    type: ClassVar[str] = "range"
    reads_forces: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        history = motion.history(self.of)
        low, high = history.extremes()
        return Finding(high.value - low.value, motion.quantity(self.of), (low.x, high.x))


@dataclass(frozen=True)
class Peak(_OfQuantity):
    """The largest size of a quantity: the peak torque of a driver, the largest force on a pin."""

    type: ClassVar[str] = "peak"
    reads_forces: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        peak = motion.history(self.of).largest_size()
        return Finding(peak.value, motion.quantity(self.of), (peak.x,))


@dataclass(frozen=True)
class PeakSpeed(_OfQuantity):
    """The largest size of the speed of a quantity, or of a point 'body.point'."""

    type: ClassVar[str] = "peak_speed"
    reads_points: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        peak = motion.derivative(self.of, 1).largest_size()
        return Finding(peak.value, motion.quantity(self.of, 1), (peak.x,))


@dataclass(frozen=True)
class PeakAcceleration(_OfQuantity):
    """The largest size of the acceleration of a quantity, or of a point 'body.point'."""

    type: ClassVar[str] = "peak_acceleration"
    reads_points: ClassVar[bool] = True

    def read(self, motion: Motion) -> Finding:
        peak = motion.derivative(self.of, 2).largest_size()
        return Finding(peak.value, motion.quantity(self.of, 2), (peak.x,))


@dataclass(frozen=True)
class LowestMargin(Reading):
    """The smallest margin of the samples from a singular point: 1 / condition, 0 at a singular point."""

    type: ClassVar[str] = "lowest_margin"

    name: str
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        value, x = motion.lowest_margin()
        return Finding(value, Quantity("number"), (x,))


@dataclass(frozen=True)
class TimeRatio(Reading):
    """Time of the slower stroke over that of the faster one (quick return), of a motion that goes round.

    The strokes lie between the smallest and the largest value of the quantity, one after the other. Of a quantity that
    repeats on the way, as over several turns of a crank, they are those of one repeat.
    """

    type: ClassVar[str] = "time_ratio"

    name: str
    of: Measured

    def read(self, motion: Motion) -> Finding:
        lacks = motion.at_rest(self.of), motion.turning_on(self.of, "so it has no two strokes")
        if not lacks[0][0].all():
            motion.require_closed(self.type)
        history = motion.history(self.of)
        low, high = (extreme.x for extreme in history.extremes())
        period = history.span / history.repeats()
        stroke = abs(high - low) % period
        longer = 0.5 * (period + abs(period - 2.0 * stroke))
        at = tuple(history.x[0] + (x - history.x[0]) % period for x in (low, high))
        return Finding(motion.ratio(longer, period - longer), Quantity("number"), at, lacks)


@dataclass(frozen=True)
class Dwell(Reading):
    """How far the driver moves while a quantity stays within a band below its maximum or above its minimum."""

    type: ClassVar[str] = "dwell"

    name: str
    of: Measured
    band: Annotated[float, LawQuantity("led"), "height of the band, positive"]
    near: Annotated[str, Reference("choice", ("maximum", "minimum")), "'maximum' or 'minimum'"] = "maximum"
    begin: Begin = None
    end: End = None

    def check(self) -> None:
        if not self.band > 0.0:
            raise MechanismError(f"[measures.{self.name}] band = {float(self.band):g} must be positive")

    def read(self, motion: Motion) -> Finding:
        history = motion.history(self.of)
        start, stop = (history if self.near == "maximum" else history.negative()).stay(self.band)
        lacks = (motion.turning_on(self.of, f"so it has no {self.near}"),)
        return Finding(motion.driven_between(start, stop), motion.driver_quantity, (start, stop), lacks)


PathPoint = Annotated[PointName, "the point that traces the path"]
LENGTH = Quantity("length")


@dataclass(frozen=True)
class _OfPath(Reading):
    """A deviation of the path of a point."""

    name: str
    of: PathPoint
    begin: Begin = None
    end: End = None


@dataclass(frozen=True)
class Straightness(_OfPath):
    """Deviation of a path from a straight line: the largest distance from the line for which it is smallest."""

    type: ClassVar[str] = "straightness"

    def read(self, motion: Motion) -> Finding:
        return Finding(motion.deviation(self.of, "line"), LENGTH)


@dataclass(frozen=True)
class Roundness(_OfPath):
    """Deviation of a path from a circle: the largest distance from the circle for which it is smallest."""

    type: ClassVar[str] = "roundness"

    def read(self, motion: Motion) -> Finding:
        return Finding(motion.deviation(self.of, "circle"), LENGTH)


@dataclass(frozen=True)
class PathDistance(Reading):
    """The largest distance of target points from a path; 0 if the path passes through all of them."""

    type: ClassVar[str] = "path_distance"

    name: str
    of: PathPoint
    targets: Annotated[tuple[tuple[float, float], ...], "target points [[x, y], ...] in the world"]
    begin: Begin = None
    end: End = None

    def __post_init__(self) -> None:
        try:
            points = tuple((x, y) for x, y in self.targets)
        except (TypeError, ValueError):
            raise MechanismError(
                f"[measures.{self.name}] targets = {self.targets!r} must be a list of points [[x, y], ...]"
            ) from None
        object.__setattr__(self, "targets", points)

    def check(self) -> None:
        if not self.targets:
            raise MechanismError(f"[measures.{self.name}] targets must hold one point or more")

    def read(self, motion: Motion) -> Finding:
        distance, x = motion.path_distance(self.of, self.targets)
        return Finding(distance, LENGTH, (x,))
