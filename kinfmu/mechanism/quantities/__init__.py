"""Quantities of a pose that a joint holds, a driver drives or a coupling relates."""

from __future__ import annotations

from kinfmu.mechanism.quantities.measure import (
    AngleBetween,
    CoordinateOf,
    DistanceBetween,
    OffsetFrom,
    PoseQuantity,
    PositionAlong,
)

POSE_QUANTITIES: tuple[type[PoseQuantity], ...] = (
    AngleBetween,
    CoordinateOf,
    DistanceBetween,
    PositionAlong,
    OffsetFrom,
)

__all__ = [
    "POSE_QUANTITIES",
    "AngleBetween",
    "CoordinateOf",
    "DistanceBetween",
    "OffsetFrom",
    "PoseQuantity",
    "PositionAlong",
]
