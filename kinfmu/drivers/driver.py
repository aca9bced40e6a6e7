"""The contract of a driver: a constraint row whose target moves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from kinfmu.laws import Law
from kinfmu.measures import Measure
from kinfmu.measures.arithmetic import Value
from kinfmu.measures.placement import Placement
from kinfmu.units import Quantity


class Driver(ABC):
    """One driving row Phi(q, t): a measured quantity follows u(t).

        Phi = measure - u(t)        (1 row; a measure may define its own row)

    A leaf is a frozen dataclass with fields `name`, its own keys, and last `law`. `noun` names the input of an FMU:
    a driver `crank` with noun `angle` has the inputs `crank_angle`, `crank_speed` and `crank_acceleration`.
    """

    type: ClassVar[str]
    noun: ClassVar[str]
    quantity: ClassVar[Quantity]
    name: str
    law: Law

    @abstractmethod
    def measured(self) -> Measure:
        """Return the driven quantity."""

    def bodies(self) -> tuple[str, ...]:
        """Return the names of the bodies in the row, ground included."""
        return self.measured().bodies()

    def residual(self, at: Placement, target: Value) -> Value:
        """Return Phi of the driving row for a target u."""
        return self.measured().row(at, target)

    @property
    def law_kinds(self) -> tuple[str, str]:
        """Kinds of the law's output and of its input."""
        return self.quantity.kind, "time"

    def check(self) -> None:
        """Raise a MechanismError for invalid values; numbers are finite and references valid by then."""
        self.law.check(f"[drivers.{self.name}]")

    def inputs(self) -> tuple[str, str, str]:
        """Return the names of the inputs for value, speed and acceleration."""
        return f"{self.name}_{self.noun}", f"{self.name}_speed", f"{self.name}_acceleration"
