"""The arithmetic of joints and laws: `+ - * /` of the operands, and the functions of this module.

One formula serves floats (direct evaluation), complex numbers (derivative tests), Taylor numbers (the readable
reference) and symbols (generated code): a package with its own kind of number registers it with these functions.
"""

from __future__ import annotations

import cmath
import math
from decimal import Decimal
from functools import singledispatch
from typing import Any

from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value

Value = Any  # float, complex, Taylor number, array or symbol: whatever the operands are


@singledispatch
def sin(x: Value) -> Value:
    """Return the sine of an angle [rad]."""
    return math.sin(x)


@singledispatch
def cos(x: Value) -> Value:
    """Return the cosine of an angle [rad]."""
    return math.cos(x)


@singledispatch
def sqrt(x: Value) -> Value:
    """Return the square root."""
    return math.sqrt(x)


@singledispatch
def floor(x: Value) -> Value:
    """Return the largest whole number not above x; its derivative is 0, also at whole numbers."""
    return float(math.floor(x))


@singledispatch
def curve(x: Value, data: CurveData, order: int = 0) -> Value:
    """Return the derivative of an order (0: the value) of a piecewise function at x; data as in `solver.curve`."""
    return curve_value(data, order, x)


def atan2(y: Value, x: Value) -> Value:
    """Return the angle of the vector (x, y) in [-pi, pi] [rad]; its derivative is that of the continuous angle."""
    return atan2_like(x if isinstance(y, float | int) else y, y, x)


@singledispatch
def atan2_like(like: Value, y: Value, x: Value) -> Value:  # noqa: ARG001  dispatched on its type
    """Return atan2(y, x) in the arithmetic of `like`, one of the two: a new kind of number registers it."""
    return math.atan2(y, x)


def split_periods(x: Value, begin: Value, *period: Value) -> tuple[Value, Value]:
    """Return how many whole periods lie between begin and x, and x without them, exact after millions of them.

        n = floor((x - begin) / p),   rest = x - n p,   p = the sum of `period`

    Sum and product are each formed as two numbers, the rounded one and its rounding error (Knuth's sum, Dekker's
    product); n p, rounded, would lose as many digits as n has. The rest has the derivative of x.

    x: The argument to reduce. begin: Where a period begins. period: Parts of the period; their sum may be rounded.
    """
    whole: Value = 0.0
    small: Value = 0.0
    for part in period:
        whole, left = _exact_sum(whole, part)
        small = small + left
    times = floor((x - begin) / whole)
    product, left = _exact_product(times, whole)
    return times, (x - product) - left - times * small


def sine_of_line(slope: Value, x: Value, intercept: Value) -> Value:
    """Return sin(slope x + intercept), exact after thousands of turns.

        sin(p + e) = sin p + e cos p,   p: the rounded phase, e: its rounding error, |e| <= eps |p|

    slope: Angle per unit of x. x: Argument. intercept: Angle at x = 0 [rad].
    """
    product, left = _exact_product(slope, x)
    phase, left_too = _exact_sum(product, intercept)
    return sin(phase) + cos(phase) * (left + left_too)


def _exact_sum(a: Value, b: Value) -> tuple[Value, Value]:
    """Return a + b, rounded, and its rounding error (Knuth)."""
    total = a + b
    back = total - a
    return total, (a - (total - back)) + (b - back)


def _exact_product(a: Value, b: Value) -> tuple[Value, Value]:
    """Return a b, rounded, and its rounding error (Dekker)."""
    product = a * b
    (high, low), (high_too, low_too) = _halves(a), _halves(b)
    return product, ((high * high_too - product) + high * low_too + low * high_too) + low * low_too


def _halves(x: Value) -> tuple[Value, Value]:
    """Return two numbers of 26 bits whose sum is x (Dekker): products of such halves are exact."""
    scaled = 134217729.0 * x  # 2^27 + 1
    high = scaled - (scaled - x)
    return high, x - high


def decimal_sum(a: Any, b: float) -> Any:
    """Return a + b as decimals, rounded once: 1000000.7 - 1000000 is 0.7; an expression gets b as a term."""
    if isinstance(a, int | float):
        return float(Decimal(repr(float(a))) + Decimal(repr(float(b))))
    return a + b


sin.register(complex, cmath.sin)
cos.register(complex, cmath.cos)
sqrt.register(complex, cmath.sqrt)


# Complex numbers carry a derivative in their imaginary part (complex step). Functions without an analytic continuation
# are evaluated at the real part, with their derivative to first order.


@floor.register
def _(x: complex) -> complex:
    return complex(math.floor(x.real))


@curve.register
def _(x: complex, data: CurveData, order: int = 0) -> complex:
    return complex(curve_value(data, order, x.real), x.imag * curve_value(data, order + 1, x.real))


@atan2_like.register
def _(like: complex, y: complex, x: complex) -> complex:  # noqa: ARG001
    y, x = complex(y), complex(x)
    turned = (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real)
    return complex(math.atan2(y.real, x.real), turned)
