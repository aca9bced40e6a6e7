from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.joints.arithmetic import Value, sin
from kinfmu.joints.laws.law import Frequency, Law, Led, Phase

NEARLY = 1e-9  # of a turn; by how much a period may miss, so that degrees and rounding do no harm


@dataclass(frozen=True)
class Harmonic(Law):
    """A harmonic motion.

        u = start + amplitude sin(frequency x + phase)

    amplitude: half of the whole way; start: middle of the motion; frequency: [rad] per unit of x, over time also in Hz;
    phase: [rad].
    """

    type: ClassVar[str] = "harmonic"

    amplitude: Led
    frequency: Frequency
    start: Led = 0.0
    phase: Phase = 0.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["amplitude"] * sin(constants["frequency"] * x + constants["phase"])

    def why_not_periodic(self, period: float, told: str) -> str:
        waves = self.frequency * period / (2.0 * math.pi)
        if abs(waves - round(waves)) <= NEARLY:
            return ""
        return f"frequency = {float(self.frequency)!r} makes {waves:.6g} waves in {told}, no whole number"
