"""Measures: quantities of a pose that a joint holds, a driver drives or a coupling relates."""

from __future__ import annotations

from kinfmu.measures.measure import AngleBetween, CoordinateOf, DistanceBetween, Measure, OffsetFrom, PositionAlong

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
