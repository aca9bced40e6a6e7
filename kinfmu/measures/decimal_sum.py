"""The sum of two numbers as decimals: 1000000.7 - 1000000 is 0.7, which floats give with six digits fewer."""

from __future__ import annotations

from decimal import Decimal
from typing import Any


def decimal_sum(a: Any, b: float) -> Any:
    """Return a + b as decimal numbers, rounded once; an expression gets b as a term."""
    if isinstance(a, int | float):
        return float(Decimal(repr(float(a))) + Decimal(repr(float(b))))
    return a + b
