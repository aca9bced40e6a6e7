"""Taylor numbers of any order have the same lower derivatives, to the bit; the third is that of the second."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kinfmu.mechanism.quantities.arithmetic import atan2, cos, curve, floor, sin, split_periods, sqrt
from kinfmu.plan.equations.taylor import Taylor
from tests.solver.test_curve import STEPS

FORMULAS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: x + y - 2.0 * x + 0.3,
    lambda x, y: 0.3 - x * y * 1.7 + (-y),
    lambda x, y: x / y / 0.7 - 1.3 / x,
    lambda x, y: np.float64(2.5) * x - np.float64(1.5) / y + np.float64(0.1),
    lambda x, y: sin(x) * cos(y) - cos(x * y),
    lambda x, y: sqrt(x * x + y * y),
    lambda x, y: atan2(y, x) + atan2(0.4, x) + atan2(y, -1.1) + atan2(x - x, y - y),
    lambda x, y: floor(x) + y,
    lambda x, y: curve(0.1 * x, STEPS) + curve(0.2 * y, STEPS, 1),
    lambda x, y: split_periods(100.0 * x, y, 0.25)[1],
]


@pytest.mark.parametrize("formula", FORMULAS)
def test_a_derivative_does_not_depend_on_where_the_series_is_cut_off(formula: Callable[[Any, Any], Any]) -> None:
    x, y = (1.37, np.array([1.0, 0.0]), 0.3, -0.2), (0.71, np.array([0.0, 1.0]), -0.7, 0.4)
    full = formula(Taylor.of(3, *x), Taylor.of(3, *y))
    for order in (1, 2):
        short = formula(Taylor.of(order, *x[: order + 1]), Taylor.of(order, *y[: order + 1]))
        for k in range(order + 1):
            np.testing.assert_array_equal(short.derivative(k) + np.zeros(2), full.derivative(k) + np.zeros(2))


def test_the_derivatives_of_a_length_that_stays_0_are_0() -> None:
    x = Taylor.of(2, 1.37, 0.7, -0.2)
    assert [sqrt(x - x).derivative(k) for k in range(3)] == [0.0, 0.0, 0.0]


def test_the_third_derivative_is_that_of_the_second() -> None:
    def formula(x: Any) -> Any:
        return atan2(sin(x) + 2.0, sqrt(x * x + 1.0)) / (1.5 + cos(x)) + curve(0.1 * x, STEPS)

    def second(t: float) -> Any:
        x, d1 = 0.6 + 0.8 * t + 0.15 * t**2 + 0.05 * t**3, 0.8 + 0.3 * t + 0.15 * t**2
        return formula(Taylor.of(2, x, d1, 0.3 + 0.3 * t)).derivative(2)

    h = 1e-4
    slope = (8.0 * (second(h) - second(-h)) - (second(2.0 * h) - second(-2.0 * h))) / (12.0 * h)
    assert formula(Taylor.of(3, 0.6, 0.8, 0.3, 0.3)).derivative(3) == pytest.approx(slope, rel=1e-9)
