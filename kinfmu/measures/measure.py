"""The contract of a measure: a quantity of a pose that can be held (a joint), driven, or coupled to another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from kinfmu.measures.arithmetic import Value
from kinfmu.measures.placement import Placement


class Measure(ABC):
    """One number of a pose, in plain arithmetic.

    A leaf is a frozen dataclass; its fields are keys of the table that names it, such as
    `{ measure = "angle", of = "rocker" }`. `kind` is 'length' or 'angle'.
    """

    type: ClassVar[str]  # its name in mechanism files
    kind: ClassVar[str]
    is_absolute: ClassVar[bool] = False  # True if it depends on the world's origin

    @abstractmethod
    def bodies(self) -> tuple[str, ...]:
        """Return the names of its bodies, ground included."""

    @abstractmethod
    def value(self, at: Placement) -> Value:
        """Return the quantity in a pose."""

    def row(self, at: Placement, target: Value) -> Value:
        """Return a residual that is zero where the quantity is `target`."""
        return self.value(at) - target

    def scale(self, target: float) -> float:  # noqa: ARG002  some rows depend on it
        """Return the change of the row per change of the quantity, where it is `target`."""
        return 1.0

    def gap(self, residual: float, target: float) -> float:
        """Return the difference of the quantity and `target` where the row has this residual."""
        return residual / self.scale(target)
