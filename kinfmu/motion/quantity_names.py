"""The names of what measures read: coordinates with their rates, and forces."""

from __future__ import annotations

from functools import cached_property

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.units import CoordinateName, ForceName


class QuantityNames:
    """Names of the quantities of a mechanism."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism

    @cached_property
    def orders(self) -> dict[str, tuple[CoordinateName, int]]:
        """Each coordinate and its rates, with the coordinate and the order."""
        return coordinate_orders(self._mechanism)

    @cached_property
    def forces(self) -> dict[str, tuple[ForceName, ...]]:
        """Forces that are measured, by name."""
        return {name: made for name, made in measured_forces(self._mechanism).items() if name not in self.orders}
