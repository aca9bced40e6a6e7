"""RunSettings: the run that a mechanism is meant for."""

from __future__ import annotations

from dataclasses import dataclass

from kinfmu.errors import MechanismError
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.valid import check_number


@dataclass(frozen=True)
class RunSettings:
    """The run that a mechanism is meant for: from start to stop in communication steps, all [s]."""

    start: float = 0.0
    stop: float = 1.0
    step: float = 0.01

    def __post_init__(self) -> None:
        values = [getattr(self, key) for key in ("start", "stop", "step")]
        if any(isinstance(value, str | Expression) for value in values):
            return  # checked when the mechanism has resolved them
        for key, value in zip(("start", "stop", "step"), values, strict=True):
            check_number(f"[run] {key}", value)
        if self.step <= 0.0:
            raise MechanismError(f"[run] step = {self.step!r} must be positive")
        if self.stop < self.start:
            raise MechanismError(f"[run] stop = {self.stop!r} lies before start = {self.start!r}")
