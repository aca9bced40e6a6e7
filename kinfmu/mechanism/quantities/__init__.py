"""Quantities of a pose that a joint holds, a driver drives or a coupling relates."""

from __future__ import annotations

from kinfmu.mechanism.quantities.measure import (
    AngleBetween,
    CoordinateOf,
    CosineBetween,
    DistanceBetween,
    OffsetFrom,
    PoseQuantity,
    PositionAlong,
    cosine_between,
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
    "CosineBetween",
    "DistanceBetween",
    "OffsetFrom",
    "PoseQuantity",
    "PositionAlong",
    "cosine_between",
]
