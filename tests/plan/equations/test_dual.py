"""Dual numbers are Taylor numbers to first order, to the bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kinfmu.mechanism.quantities.arithmetic import atan2, cos, curve, floor, sin, split_periods, sqrt
from kinfmu.plan.equations.dual import Dual
from kinfmu.plan.equations.taylor import Taylor
from tests.solver.test_curve import STEPS

FORMULAS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: x + y - 2.0 * x + 0.3,
    lambda x, y: 0.3 - x * y * 1.7 + (-y),
    lambda x, y: x / y / 0.7 - 1.3 / x,
    lambda x, y: np.float64(2.5) * x - np.float64(1.5) / y + np.float64(0.1),
    lambda x, y: sin(x) * cos(y) - cos(x * y),
    lambda x, y: sqrt(x * x + y * y) + sqrt(x - x),
    lambda x, y: atan2(y, x) + atan2(0.4, x) + atan2(y, -1.1) + atan2(x - x, y - y),
    lambda x, y: floor(x) + y,
    lambda x, y: curve(0.1 * x, STEPS) + curve(0.2 * y, STEPS, 1),
    lambda x, y: split_periods(100.0 * x, y, 0.25)[1],
]


@pytest.mark.parametrize("formula", FORMULAS)
def test_value_and_gradient_equal_the_first_order_of_taylor_numbers(formula: Callable[[Any, Any], Any]) -> None:
    values, unit = (1.37, 0.71), np.eye(2)
    dual = formula(*map(Dual, values, unit))
    taylor = formula(*map(Taylor, values, unit))
    assert dual.f == taylor.f
    assert np.broadcast_to(dual.g, 2).tolist() == np.broadcast_to(taylor.d1, 2).tolist()


def test_the_gradient_of_a_formula_without_the_coordinates_is_zero() -> None:
    assert (Dual(2.0) * Dual(3.0) + 1.0).g == 0.0
