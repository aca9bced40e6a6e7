"""Readings: the numbers that designers read off a motion, as `[measures]` of a mechanism file declares them."""

from __future__ import annotations

from kinfmu.readings.extremes import LowestMargin, Maximum, Minimum, Peak, PeakAcceleration, PeakSpeed, Range
from kinfmu.readings.paths import PathDistance, Roundness, Straightness
from kinfmu.readings.reading import Finding, Measured, Reading
from kinfmu.readings.timing import Dwell, TimeRatio
from kinfmu.readings.transfer import MechanicalAdvantage, PressureAngle, TransmissionAngle, VelocityRatio

READINGS: tuple[type[Reading], ...] = (
    Minimum,
    Maximum,
    Range,
    Peak,
    PeakSpeed,
    PeakAcceleration,
    TimeRatio,
    Dwell,
    Straightness,
    Roundness,
    PathDistance,
    TransmissionAngle,
    PressureAngle,
    VelocityRatio,
    MechanicalAdvantage,
    LowestMargin,
)

__all__ = [
    "READINGS",
    "Dwell",
    "Finding",
    "LowestMargin",
    "Maximum",
    "Measured",
    "MechanicalAdvantage",
    "Minimum",
    "PathDistance",
    "Peak",
    "PeakAcceleration",
    "PeakSpeed",
    "PressureAngle",
    "Range",
    "Reading",
    "Roundness",
    "Straightness",
    "TimeRatio",
    "TransmissionAngle",
    "VelocityRatio",
]
