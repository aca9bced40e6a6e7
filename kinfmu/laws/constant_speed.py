from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.law import Law, Led, LedRate
from kinfmu.measures.arithmetic import Value


@dataclass(frozen=True)
class ConstantSpeed(Law):
    """Uniform motion.

        u = start + speed x

    start: value at x = 0; speed: rate, such as [rad/s] or [length/s] after the driver's quantity.
    """

    type: ClassVar[str] = "constant_speed"

    start: Led = 0.0
    speed: LedRate = 1.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["speed"] * x
