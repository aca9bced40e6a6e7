"""The contract of a law of motion: f(t), in plain arithmetic; its rate and acceleration follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from kinfmu.joints.arithmetic import Value


class Law(ABC):
    """Target of a driver over time, u = f(t).

    A leaf is a frozen dataclass; its fields are keys of the driver's table in a mechanism file and become FMU
    parameters `<driver>.<key>`. `orders` says which time derivative of the driver's quantity each constant is.
    """

    type: ClassVar[str]
    orders: ClassVar[dict[str, int]]  # by constant: 0 like the driver's quantity, 1 its rate, 2 its acceleration

    @abstractmethod
    def target(self, t: Value, **constants: Value) -> Value:
        """f(t), in plain arithmetic, with the constants given by name."""
