"""Drivers: a driver is a row whose target follows a law.

To add one, write its class and add a line here.
"""

from __future__ import annotations

from kinfmu.mechanism.drivers.driver import (
    AngleDriver,
    CoordinateDriver,
    DistanceDriver,
    Driver,
    RelativeAngleDriver,
    SlideDriver,
)

DRIVERS: tuple[type[Driver], ...] = (
    AngleDriver,
    RelativeAngleDriver,
    CoordinateDriver,
    SlideDriver,
    DistanceDriver,
)

__all__ = [
    "DRIVERS",
    "AngleDriver",
    "CoordinateDriver",
    "DistanceDriver",
    "Driver",
    "RelativeAngleDriver",
    "SlideDriver",
]
