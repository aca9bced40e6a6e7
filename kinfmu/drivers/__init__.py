"""Drivers and laws of motion, one a file: a driver is a row whose target moves, a law is how the target moves.

Adding one is a file and a line here.
"""

from __future__ import annotations

from kinfmu.drivers.angle import AngleDriver
from kinfmu.drivers.constant_speed import ConstantSpeed
from kinfmu.drivers.coordinate import CoordinateDriver
from kinfmu.drivers.distance import DistanceDriver
from kinfmu.drivers.driver import Driver
from kinfmu.drivers.law import Law
from kinfmu.drivers.relative_angle import RelativeAngleDriver
from kinfmu.drivers.slide import SlideDriver

DRIVERS: tuple[type[Driver], ...] = (
    AngleDriver,
    RelativeAngleDriver,
    CoordinateDriver,
    SlideDriver,
    DistanceDriver,
)
LAWS: tuple[type[Law], ...] = (ConstantSpeed,)

__all__ = [
    "DRIVERS",
    "LAWS",
    "AngleDriver",
    "ConstantSpeed",
    "CoordinateDriver",
    "DistanceDriver",
    "Driver",
    "Law",
    "RelativeAngleDriver",
    "SlideDriver",
]
