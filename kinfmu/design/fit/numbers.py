"""Numbers of targets, bounds and constraints: bare or with a unit, alone or as bounds [low, high]."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import MechanismError
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.units import Quantity

Numeral = float | str  # bare or with a unit


class Bounds(NamedTuple):
    """Bounds of an unknown."""

    low: float
    high: float


def read_bounds(where: str, value: object, quantity: Quantity, unit: str) -> Bounds:
    """Return bounds [low, high], low below high.

    Raises:
        MechanismError: The value is not two numbers in ascending order.

    """
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
        raise MechanismError(f"{where} = {quoted(value)} must be bounds [low, high]")
    low, high = (read_constant(where, one, quantity, unit) for one in value)
    if not low < high:
        raise MechanismError(f"{where} = {quoted(value)}: the low bound must be below the high one")
    return Bounds(low, high)


def read_free(where: str, value: Any, quantity: Quantity, unit: str) -> float | Bounds:
    """Return a number, or the bounds of an unknown; None is 0."""
    if value is None:
        return 0.0
    if isinstance(value, str) or not isinstance(value, Sequence):
        return read_constant(where, value, quantity, unit)
    return read_bounds(where, value, quantity, unit)


def flat(value: Any) -> Iterable[object]:
    """Return the numbers of a number, of bounds or of a list."""
    return value if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else (value,)


def read_rows(where: str, rows: Any, quantities: Sequence[Quantity], unit: str, example: str) -> FloatArray:
    """Return rows of numbers (m, d), one of each quantity.

    Raises:
        MechanismError: There are no rows, or a row has other than d numbers.

    """
    valid = f"{where} must be a list {example}"
    if isinstance(rows, str) or not isinstance(rows, Sequence | np.ndarray) or not len(rows):
        raise MechanismError(f"{where} = {quoted(rows)} must be a list {example}")
    found = []
    for k, row in enumerate(rows, start=1):
        if isinstance(row, str) or not isinstance(row, Sequence | np.ndarray) or len(row) != len(quantities):
            raise MechanismError(f"{valid}; number {k} is {quoted(row)}")
        found.append([read_constant(f"{where}, number {k},", n, q, unit) for n, q in zip(row, quantities, strict=True)])
    return np.array(found)


def read_weights(where: str, value: Any, count: int) -> FloatArray:
    """Return weights (count,), each at least 0 and not all 0.

    Raises:
        MechanismError: A weight is no such number, or there are other than `count`.

    """
    weights = [value] * count if is_number(value) else value
    if isinstance(weights, str) or not isinstance(weights, Sequence | np.ndarray) or not all(map(is_number, weights)):
        raise MechanismError(f"{where} = {quoted(value)} must be a number, or a list of one for each point")
    if len(weights) != count:
        raise MechanismError(f"{where} has {len(weights)} numbers for {count} points")
    found = np.array(weights, dtype=float)
    if not (np.isfinite(found).all() and (found >= 0.0).all() and found.any()):
        raise MechanismError(f"{where} = {quoted(value)}: weights must be 0 or more, and one of them above 0")
    return found
