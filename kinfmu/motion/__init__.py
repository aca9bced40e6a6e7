"""Motion: the arithmetic of what designers read off a motion, on arrays of samples and of designs."""

from __future__ import annotations

from kinfmu.motion.designs import DesignMeasures, measure_designs
from kinfmu.motion.measure import MeasuredValue, MeasuredValues, measure
from kinfmu.motion.motion import Motion
from kinfmu.motion.track import Extreme, Track

__all__ = [
    "DesignMeasures",
    "Extreme",
    "MeasuredValue",
    "MeasuredValues",
    "Motion",
    "Track",
    "measure",
    "measure_designs",
]
