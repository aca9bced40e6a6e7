"""Extremes and range of a quantity, its peak speed and acceleration, and the lowest margin from singular points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.mechanism.measures.reading import Begin, End, Finding, Measured, Motion, Reading
from kinfmu.units import Quantity


@dataclass(frozen=True)
class Minimum(Reading):
    """The smallest value of a quantity."""

    type: ClassVar[str] = "minimum"
    reads_forces: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        low = motion.history(self.of).minimum()
        return Finding(low.value, motion.quantity(self.of), (low.x,))


@dataclass(frozen=True)
class Maximum(Reading):
    """The largest value of a quantity."""

    type: ClassVar[str] = "maximum"
    reads_forces: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        high = motion.history(self.of).maximum()
        return Finding(high.value, motion.quantity(self.of), (high.x,))


@dataclass(frozen=True)
class Range(Reading):
    """The largest value minus the smallest: the stroke of a slide, the swing angle of a rocker.

    It occurs at two values of the driver: of the smallest and of the largest value.
    """

    type: ClassVar[str] = "range"
    reads_forces: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        history = motion.history(self.of)
        low, high = history.extremes()
        return Finding(high.value - low.value, motion.quantity(self.of), (low.x, high.x))


@dataclass(frozen=True)
class Peak(Reading):
    """The largest size of a quantity: the peak torque of a driver, the largest force on a pin."""

    type: ClassVar[str] = "peak"
    reads_forces: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        peak = motion.history(self.of).largest_size()
        return Finding(peak.value, motion.quantity(self.of), (peak.x,))


@dataclass(frozen=True)
class PeakSpeed(Reading):
    """The largest size of the speed of a quantity, or of a point 'body.point'."""

    type: ClassVar[str] = "peak_speed"
    reads_points: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

    def read(self, motion: Motion) -> Finding:
        peak = motion.derivative(self.of, 1).largest_size()
        return Finding(peak.value, motion.quantity(self.of, 1), (peak.x,))


@dataclass(frozen=True)
class PeakAcceleration(Reading):
    """The largest size of the acceleration of a quantity, or of a point 'body.point'."""

    type: ClassVar[str] = "peak_acceleration"
    reads_points: ClassVar[bool] = True

    name: str
    of: Measured
    begin: Begin = None
    end: End = None

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
