"""Drivers and laws of motion, one a file: a driver is a row whose target moves, a law is how the target moves.

Adding one is a file and a line here.
"""

from __future__ import annotations

from kinfmu.drivers.angle import Angle
from kinfmu.drivers.constant_speed import ConstantSpeed
from kinfmu.drivers.driver import Driver
from kinfmu.drivers.law import Law

DRIVERS: tuple[type[Driver], ...] = (Angle,)
LAWS: tuple[type[Law], ...] = (ConstantSpeed,)

__all__ = ["DRIVERS", "LAWS", "Angle", "ConstantSpeed", "Driver", "Law"]
