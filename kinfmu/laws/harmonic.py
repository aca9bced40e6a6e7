from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.laws.law import NEARLY, Frequency, Law, Led, Phase
from kinfmu.measures.arithmetic import Value, sine_of_line


@dataclass(frozen=True)
class Harmonic(Law):
    """A harmonic motion.

        u = start + amplitude sin(frequency x + phase)

    Periodic over a turn of x if `frequency` is a whole number.
    """

    type: ClassVar[str] = "harmonic"

    amplitude: Annotated[Led, "half of the peak-to-peak stroke"]
    frequency: Annotated[Frequency, "[rad] per unit of x, over time also in Hz"]
    start: Annotated[Led, "middle of the motion"] = 0.0
    phase: Annotated[Phase, "[rad]"] = 0.0

    def target(self, x: Value, **constants: Value) -> Value:
        return constants["start"] + constants["amplitude"] * sine_of_line(constants["frequency"], x, constants["phase"])

    def why_not_periodic(self) -> str:
        if abs(self.frequency - round(self.frequency)) <= NEARLY:
            return ""
        return f"frequency = {float(self.frequency)!r} must be a whole number of waves in a turn"
