"""Drivers, one per file: a driver is a row whose target follows a law.

To add one, write a file and add a line here.
"""

from __future__ import annotations

from kinfmu.drivers.angle import AngleDriver
from kinfmu.drivers.coordinate import CoordinateDriver
from kinfmu.drivers.distance import DistanceDriver
from kinfmu.drivers.driver import Driver
from kinfmu.drivers.relative_angle import RelativeAngleDriver
from kinfmu.drivers.slide import SlideDriver

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
