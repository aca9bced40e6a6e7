"""Measures: quantities of a pose that a joint holds, a driver drives or a coupling relates."""

from __future__ import annotations

from kinfmu.measures.angle import AngleBetween
from kinfmu.measures.coordinate import CoordinateOf
from kinfmu.measures.distance import DistanceBetween
from kinfmu.measures.measure import Measure
from kinfmu.measures.slide import OffsetFrom, PositionAlong

MEASURES: tuple[type[Measure], ...] = (AngleBetween, CoordinateOf, DistanceBetween, PositionAlong, OffsetFrom)

__all__ = [
    "MEASURES",
    "AngleBetween",
    "CoordinateOf",
    "DistanceBetween",
    "Measure",
    "OffsetFrom",
    "PositionAlong",
]
