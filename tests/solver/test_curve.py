"""Piecewise functions at run time, against 50 digits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu.mechanism.quantities.arithmetic import atan2, curve, floor
from kinfmu.plan.equations.graph import Graph, evaluate
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as value
from tests import power_series
from tests.power_series import Series

PLAIN: CurveData = ((), ((0.5, (2.0, -1.0, 3.0, 0.25), 0.5, 2.0, 0.75),))
STEPS: CurveData = (
    (0.0, 1.0),
    ((0.0, (1.0,), 0.0, 0.0, 0.0), (0.0, (2.0, 3.0, 1.0), 0.25, -4.0, 0.0), (1.0, (5.0, 6.0), 0.0, 0.0, 0.0)),
)
numbers = st.floats(-3.0, 3.0)


def exactly(x: float, data: CurveData, order: int) -> float:
    """The derivative of the given order, from the power series about x."""
    series = power_series.curve(Series([x, 1, 0, 0, 0, 0]), data)
    return float(series.c[order] * math.factorial(order))


@pytest.mark.parametrize("order", range(6))
@given(x=numbers)
def test_value_and_derivatives_of_every_order_are_those_of_the_series(order: int, x: float) -> None:
    for data in (PLAIN, STEPS):
        assert value(data, order, x) == pytest.approx(exactly(x, data, order), rel=1e-13, abs=1e-11)


def test_at_a_break_the_right_hand_piece_counts_and_the_outer_pieces_hold_for_all_beyond() -> None:
    assert [value(STEPS, 0, x) for x in (-9.0, -1e-300, 0.0)] == [1.0, 1.0, 1.0]
    assert [value(STEPS, 1, x) for x in (-9.0, -1e-300, 0.0)] == [0.0, 0.0, 3.0 - 1.0]
    assert value(STEPS, 1, math.nextafter(1.0, 0.0)) == pytest.approx(7.0 - math.cos(4.0))
    assert [value(STEPS, order, 1.0) for order in range(3)] == [6.0, 5.0, 0.0]
    assert [value(STEPS, order, 101.0) for order in range(3)] == [506.0, 5.0, 0.0]


def test_nan_stays_nan() -> None:
    assert math.isnan(value(STEPS, 0, math.nan))
    assert math.isnan(value(STEPS, 2, math.nan))


@given(x=numbers, rate=numbers)
def test_every_arithmetic_gives_the_same_curve(x: float, rate: float) -> None:
    graph = Graph()
    symbol = graph.symbol("x")
    node = curve(symbol, STEPS)
    (first,) = graph.derivative([node], {symbol: graph.constant(rate)})
    (second,) = graph.derivative([first], {symbol: graph.constant(rate)})
    f, d1, d2 = evaluate([node, first, second], {"x": x})
    assert f == curve(x, STEPS) == value(STEPS, 0, x)
    assert d1 == value(STEPS, 1, x) * rate
    assert d2 == value(STEPS, 2, x) * rate * rate
    taylor = curve(Taylor.of(2, x, rate), STEPS)
    assert tuple(map(taylor.derivative, range(3))) == pytest.approx((f, d1, d2), rel=1e-15)
    assert curve(complex(x, rate * 1e-30), STEPS) == complex(f, rate * 1e-30 * value(STEPS, 1, x))


def test_equal_curves_of_one_argument_are_one_node_and_a_constant_one_is_a_number() -> None:
    graph = Graph()
    x = graph.symbol("x")
    assert curve(x, STEPS) is curve(x, STEPS)
    assert curve(x, STEPS) is not curve(x, PLAIN)
    assert curve(x, STEPS, 1) is curve(x, STEPS).next_derivative()
    assert curve(graph.constant(101.0), STEPS).constant == 506.0


@given(y=st.floats(0.1, 3.0), x=numbers, dy=numbers, dx=numbers)
def test_an_angle_turns_as_the_series_says_in_every_arithmetic(y: float, x: float, dy: float, dx: float) -> None:
    exact = power_series.atan2(Series([y, dy, 0]), Series([x, dx, 0]))
    expected = [float(exact.c[0]), float(exact.c[1]), float(2 * exact.c[2])]
    taylor = atan2(Taylor.of(2, y, dy), Taylor.of(2, x, dx))
    size = 1.0 + (dx * dx + dy * dy) / (x * x + y * y)
    assert [taylor.derivative(k) for k in range(3)] == pytest.approx(expected, rel=1e-13, abs=1e-13 * size)
    graph = Graph()
    a, b = graph.symbol("y"), graph.symbol("x")
    rates = {a: graph.constant(dy), b: graph.constant(dx)}
    (first,) = graph.derivative([atan2(a, b)], rates)
    (second,) = graph.derivative([first], rates)
    traced = evaluate([atan2(a, b), first, second], {"y": y, "x": x})
    assert traced == pytest.approx(expected, rel=1e-13, abs=1e-13 * size)
    step = atan2(complex(y, dy * 1e-30), complex(x, dx * 1e-30))
    assert step.imag * 1e30 == pytest.approx(expected[1], rel=1e-13, abs=1e-13 * size)


def test_an_angle_takes_a_number_on_either_side() -> None:
    graph = Graph()
    s = graph.symbol("s")
    assert evaluate([atan2(1.0, s), atan2(s, 1)], {"s": -2.0}) == [math.atan2(1.0, -2.0), math.atan2(-2.0, 1.0)]
    assert atan2(1.0, Taylor.of(2, -2.0)).derivative(0) == math.atan2(1.0, -2.0)
    assert atan2(1.0, -2.0 + 0j) == complex(math.atan2(1.0, -2.0))
    assert atan2(1, 0) == math.pi / 2


def test_the_whole_part_stands_still() -> None:
    graph = Graph()
    s = graph.symbol("s")
    (rate,) = graph.derivative([floor(s)], {s: graph.constant(1.0)})
    assert evaluate([floor(s)], {"s": -0.5}) == [-1.0]
    assert rate.constant == 0.0
    assert floor(Taylor.of(2, 2.5, 1.0)).derivative(1) == 0.0
    assert floor(2.5 + 1e-30j) == 2.0
    assert isinstance(floor(2.5), float)
