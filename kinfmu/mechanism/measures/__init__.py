"""Readings: the numbers that designers read off a motion, as `[measures]` of a mechanism file declares them."""

from __future__ import annotations

from kinfmu.mechanism.measures.extremes import (
    Dwell,
    LowestMargin,
    Maximum,
    Minimum,
    PathDistance,
    Peak,
    PeakAcceleration,
    PeakSpeed,
    Range,
    Roundness,
    Straightness,
    TimeRatio,
)
from kinfmu.mechanism.measures.reading import Finding, Measured, Reading
from kinfmu.mechanism.measures.transfer import MechanicalAdvantage, PressureAngle, TransmissionAngle, VelocityRatio

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

_COUNTED_FROM = {reading.type: reading.counted_from for reading in READINGS}


def counted_from(kind: str) -> str:
    """Return ' from 90 deg' for the value of a type of measure that is a deviation, to show after it; '' for others."""
    datum = _COUNTED_FROM.get(kind, "")
    return f" from {datum}" if datum else ""


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
    "counted_from",
]
