"""Operations of expressions: on numbers of any arithmetic, and on their dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from kinfmu.mechanism import dimension
from kinfmu.mechanism.dimension import Dimension
from kinfmu.mechanism.quantities.arithmetic import Value, atan2, cos, sin, sqrt


class ExpressionStep(NamedTuple):
    """One step of an expression in postfix order, and its position in the text."""

    operation: str  # "number", "name", or a key of OPERATIONS
    at: int
    value: Any = None  # of "number" the float in the units used inside, of "name" the name, of "power" the exponent
    unit: str = ""  # of a number, as written
    dimension: Dimension = dimension.BARE  # of a number


class Operation(NamedTuple):
    """An operation in any arithmetic and on dimensions."""

    arity: int
    value: Callable[..., Value]
    dimension: Callable[..., Dimension]


def _tan(x: Value) -> Value:
    return sin(x) / cos(x)


def _asin(x: Value) -> Value:
    return atan2(x, sqrt((1.0 - x) * (1.0 + x)))


def _acos(x: Value) -> Value:
    return atan2(sqrt((1.0 - x) * (1.0 + x)), x)


def _power(base: Value, exponent: int) -> Value:
    """Return base ** exponent, by products only, so that every arithmetic gives the same bits."""
    product = base
    for _ in range(abs(exponent) - 1):
        product = product * base
    return 1.0 if exponent == 0 else product if exponent > 0 else 1.0 / product


OPERATORS = {
    "+": Operation(2, lambda a, b: a + b, dimension.sum_of),
    "-": Operation(2, lambda a, b: a - b, dimension.sum_of),
    "*": Operation(2, lambda a, b: a * b, dimension.product_of),
    "/": Operation(2, lambda a, b: a / b, dimension.quotient_of),
    "sign": Operation(1, lambda a: -a, lambda a: a),
    "power": Operation(1, _power, lambda a, exponent: dimension.power_of(a, Fraction(exponent))),
}
CONSTANTS = {"pi": Operation(0, lambda: math.pi, lambda: dimension.BARE)}
FUNCTIONS = {
    "sin": Operation(1, sin, dimension.ratio_of_angle),
    "cos": Operation(1, cos, dimension.ratio_of_angle),
    "tan": Operation(1, _tan, dimension.ratio_of_angle),
    "sqrt": Operation(1, sqrt, lambda a: dimension.power_of(a, Fraction(1, 2))),
    "asin": Operation(1, _asin, dimension.angle_of_ratio),
    "acos": Operation(1, _acos, dimension.angle_of_ratio),
    "atan2": Operation(2, atan2, dimension.angle_of_pair),
}
OPERATIONS = {**OPERATORS, **CONSTANTS, **FUNCTIONS}
WORDS = (*FUNCTIONS, *CONSTANTS)  # reserved: no parameter can have these names
