"""Motion: the arithmetic of what designers read off a motion, on arrays of samples and of designs."""

from __future__ import annotations

from kinfmu.motion.designs import DesignMeasures, measure_designs
from kinfmu.motion.history import Extreme, History
from kinfmu.motion.measure import MeasuredValue, MeasuredValues, measure
from kinfmu.motion.motion import Motion

__all__ = [
    "DesignMeasures",
    "Extreme",
    "History",
    "MeasuredValue",
    "MeasuredValues",
    "Motion",
    "measure",
    "measure_designs",
]
