from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.laws.law import Law, Led, LedRate
from kinfmu.measures.arithmetic import Value


@dataclass(frozen=True)
class ConstantSpeed(Law):
    """Uniform motion.

        u = start + speed x

    x: time of a driver, angle of a cam, input of a coupling.
    """

    type: ClassVar[str] = "constant_speed"

    start: Annotated[Led, "value at x = 0"] = 0.0
    speed: Annotated[LedRate, "rate, such as [rad/s] or [length/s], by the driven quantity"] = 1.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["speed"] * x
