"""The graph: simplifications keep every bit, equal expressions are one node, nothing recurses."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kinfmu.mechanism.quantities.arithmetic import atan2, atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.plan.equations.graph import Graph, evaluate, reachable, symbols
from tests import power_series
from tests.power_series import Series

Expression = Callable[[dict[str, Any]], Any]  # from the values of x, y, z: numbers or nodes

EXAMPLES = settings().max_examples  # of the profile
BINARY = (operator.add, operator.sub, operator.mul, operator.truediv)
STEPS = (
    (-1.0, 2.0),
    ((0.0, (0.5, 1.0), 0.0, 0.0, 0.0), (0.25, (1.5, -0.5, 2.0), 0.75, 3.0, 0.5), (2.0, (3.0,), 0.0, 0.0, 0.0)),
)
special = st.sampled_from([0.0, 1.0, -1.0, 2.0, 0.5, -0.0])  # what simplifications look for
uneven = st.integers(-(10**9), 10**9).map(lambda n: n / 1e8)  # decimals whose every operation rounds
numbers = st.one_of(special, uneven)


def leaf(name: str) -> Expression:
    return lambda values: values[name]


def constant(value: float) -> Expression:
    return lambda _: value


def stepped(x: Any) -> Any:
    return curve(x, STEPS)


def lean(y: Any, x: Any) -> Any:
    """An angle between -pi/2 and pi/2: at pi the sign of a zero, which simplifications lose, would tell."""
    return atan2(y, x * x + 1.0)


def applied(operation: Callable[..., Any], *arguments: Expression) -> Expression:
    return lambda values: operation(*(argument(values) for argument in arguments))


def expressions() -> st.SearchStrategy[Expression]:
    """Trees of + - * / - sin cos floor atan2 and a curve over x, y, z and constants."""
    leaves = st.one_of(st.sampled_from("xyz").map(leaf), numbers.map(constant))
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.builds(applied, st.sampled_from(BINARY), inner, inner),
            st.builds(applied, st.sampled_from((operator.neg, sin, cos, floor, stepped)), inner),
            st.builds(applied, st.just(lean), inner, inner),
        ),
        max_leaves=25,
    )


def direct(expression: Expression, values: dict[str, Any]) -> Any:
    """Its value, for expressions that have one."""
    try:
        value = expression(values)
    except (ZeroDivisionError, OverflowError, ValueError):  # ValueError: the sine of infinity
        assume(False)
    assume(not isinstance(value, float) or math.isfinite(value))
    return value


@settings(max_examples=10 * EXAMPLES)
@given(expression=expressions(), x=uneven, y=uneven, z=numbers)
def test_traced_and_evaluated_has_the_bits_of_direct_evaluation(
    expression: Expression, x: float, y: float, z: float
) -> None:
    values = {"x": x, "y": y, "z": z}
    expected = direct(expression, values)
    graph = Graph()
    node = graph.lift(expression({name: graph.symbol(name) for name in values}))
    assert evaluate([node], values) == [expected]


@settings(max_examples=5 * EXAMPLES)
@given(expression=expressions(), x=st.floats(0.5, 2.0), y=st.floats(-2.0, -0.5), z=st.floats(2.5, 4.0))
def test_derivatives_on_the_graph_are_those_of_power_series(
    expression: Expression, x: float, y: float, z: float
) -> None:
    values = {"x": x, "y": y, "z": z}
    direct(expression, values)
    rates = {"x": 1.0, "y": -0.5, "z": 0.25}
    try:
        exact = expression({name: Series([value, rates[name]]) for name, value in values.items()})
    except ZeroDivisionError:  # a zero in 80 digits that rounding hides
        assume(False)
    slope = float(exact.c[1]) if isinstance(exact, Series) else 0.0
    assume(abs(slope) < 1e6)
    graph = Graph()
    nodes = {name: graph.symbol(name) for name in values}
    node = graph.lift(expression(nodes))
    moving = {nodes[name]: graph.constant(rate) for name, rate in rates.items()}
    at = evaluate(reachable([node]), values)
    largest = max(map(abs, at), default=1.0) + max((1.0 / abs(v) for v in at if v != 0.0), default=1.0)
    assume(largest < 1e4)
    (derivative,) = evaluate(graph.derivative([node], moving), values)
    assert derivative == pytest.approx(slope, rel=1e-6, abs=1e-6)


@pytest.fixture(autouse=True, scope="module")
def _series() -> None:
    sin.register(Series, power_series.sin)
    cos.register(Series, power_series.cos)
    floor.register(Series, power_series.floor)
    curve.register(Series, power_series.curve)
    atan2_like.register(Series, lambda _, y, x: power_series.angle(y, x))


@given(x=st.floats(1e-6, 1e6))
def test_a_square_root_and_its_derivatives_are_right(x: float) -> None:
    graph = Graph()
    symbol, one = graph.symbol("x"), graph.constant(1.0)
    root = sqrt(symbol)
    (first,) = graph.derivative([root], {symbol: one})
    (second,) = graph.derivative([first], {symbol: one})
    exact = power_series.sqrt(Series([x, 1, 0]))
    values = evaluate([root, first, second], {"x": x})
    assert values[0] == math.sqrt(x)
    assert values == pytest.approx([float(exact.c[0]), float(exact.c[1]), float(2 * exact.c[2])], rel=1e-14)


def test_equal_expressions_are_one_node() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    assert x + y is y + x
    assert x * y is y * x
    assert sin(x + y) is sin(y + x)
    assert x - y is -(y - x)
    assert graph.constant(0.0) is graph.constant(-0.0)
    assert graph.symbol("x") is x


def test_what_does_nothing_leaves_no_node() -> None:
    graph = Graph()
    x = graph.symbol("x")
    assert x + 0.0 is x
    assert 0.0 + x is x
    assert x - 0.0 is x
    assert x * 1.0 is x
    assert x / 1.0 is x
    minus = -x
    assert -minus is x
    assert (x - x).constant == 0.0
    assert (x * 0.0).constant == 0.0
    assert (x * -1.0) is -x
    assert cos(graph.constant(0.0)).constant == 1.0


def test_what_would_round_differently_is_left_alone() -> None:
    """(x + 1) - 1 is not x in floats, and x / 3 is not x * (1 / 3)."""
    graph = Graph()
    x = graph.symbol("x")
    assert (x + 1.0) - 1.0 is not x
    assert x / 3.0 is not x * (1.0 / 3.0)
    assert evaluate([(x + 1.0) - 1.0], {"x": 1e-17}) == [0.0]


def test_an_expression_of_great_depth_is_evaluated_and_derived() -> None:
    graph = Graph()
    x = graph.symbol("x")
    node = x
    for _ in range(20_000):
        node = sin(node + 1.0)
    (derivative,) = graph.derivative([node], {x: graph.constant(1.0)})
    assert math.isfinite(evaluate([derivative], {"x": 0.3})[0])


def test_symbols_are_listed_once_in_order_of_creation() -> None:
    graph = Graph()
    x, y, _ = graph.symbol("x"), graph.symbol("y"), graph.symbol("unused")
    assert symbols([y * x + sin(y), x]) == [x, y]


def test_a_node_prints_what_it_is() -> None:
    graph = Graph()
    assert repr(graph.symbol("x") + 2.0) == "+(x, 2.0)"
