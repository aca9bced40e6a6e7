"""Loads: forces and torques on the bodies. Each is one formula along the quantities through which it does work.

To add a load, write its class and add a line here.
"""

from __future__ import annotations

from kinfmu.mechanism.loads.between import Damper, ForceBetween, GasSpring, Spring, TorsionDamper, TorsionSpring
from kinfmu.mechanism.loads.forces import ForceAlong, ForceAt, TorqueOn
from kinfmu.mechanism.loads.load import Following, Load

LOADS: tuple[type[Load], ...] = (
    ForceAt,
    ForceAlong,
    ForceBetween,
    TorqueOn,
    Spring,
    Damper,
    GasSpring,
    TorsionSpring,
    TorsionDamper,
)

__all__ = [
    "LOADS",
    "Damper",
    "Following",
    "ForceAlong",
    "ForceAt",
    "ForceBetween",
    "GasSpring",
    "Load",
    "Spring",
    "TorqueOn",
    "TorsionDamper",
    "TorsionSpring",
]
