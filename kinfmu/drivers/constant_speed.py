from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.drivers.law import Law
from kinfmu.joints.arithmetic import Value


@dataclass(frozen=True)
class ConstantSpeed(Law):
    """Uniform motion.

        u = start + speed t

    start: value at t = 0; speed: rate, [rad/s] or [length/s] after the driver's quantity.
    """

    type: ClassVar[str] = "constant_speed"
    orders: ClassVar[dict[str, int]] = {"start": 0, "speed": 1}

    start: float = 0.0
    speed: float = 1.0

    def target(self, t: Value, **constants: Value) -> Value:
        return constants["start"] + constants["speed"] * t
