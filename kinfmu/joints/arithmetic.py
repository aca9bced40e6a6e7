"""The arithmetic in which joints and laws are written: `+ - * /` of the operands, and `sin cos sqrt` from here.

One formula serves floats (direct evaluation), complex numbers (derivative tests), Taylor numbers (the dense reference)
and symbols (generated code): each room that brings its own kind of number registers it with these functions.
"""

from __future__ import annotations

import cmath
import math
from functools import singledispatch
from typing import Any

Value = Any  # float, complex, Taylor number, array or symbol: whatever the operands are


@singledispatch
def sin(x: Value) -> Value:
    """Sine of an angle [rad]."""
    return math.sin(x)


@singledispatch
def cos(x: Value) -> Value:
    """Cosine of an angle [rad]."""
    return math.cos(x)


@singledispatch
def sqrt(x: Value) -> Value:
    """Square root."""
    return math.sqrt(x)


sin.register(complex, cmath.sin)
cos.register(complex, cmath.cos)
sqrt.register(complex, cmath.sqrt)
