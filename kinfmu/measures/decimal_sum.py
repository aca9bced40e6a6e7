"""The sum of two numbers as they are written: 1000000.7 - 1000000 is 0.7, of which floats lose ten digits."""

from __future__ import annotations

from decimal import Decimal
from typing import Any


def decimal_sum(a: Any, b: float) -> Any:
    """a + b as decimal numbers, rounded once; an expression takes b as a term."""
    if isinstance(a, int | float):
        return float(Decimal(repr(float(a))) + Decimal(repr(float(b))))
    return a + b
