from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.law import NEARLY, Frequency, Law, Led, Phase
from kinfmu.measures.arithmetic import Value, sine_of_line


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
        return constants["start"] + constants["amplitude"] * sine_of_line(constants["frequency"], x, constants["phase"])

    def why_not_periodic(self) -> str:
        if abs(self.frequency - round(self.frequency)) <= NEARLY:
            return ""
        return f"frequency = {float(self.frequency)!r} must be a whole number of waves in a turn"
