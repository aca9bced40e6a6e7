"""Intervals against 100 digits, at random and at hostile places."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from kinfmu.analysis.certified import intervals
from kinfmu.analysis.certified.intervals import Intervals, angle, cosine, curve, enclosed, root, sine, whole
from kinfmu.mechanism.laws.rise import RISES, SimpleHarmonic
from kinfmu.plan.equations.graph import ExactGraph
from kinfmu.solver.python.curve import curve as curve_value

COUNT = 1500
mp = mpmath.mp.clone()
mp.dps = 100
HOSTILE = (
    0.0,
    5e-324,
    -5e-324,
    1e-300,
    1.0,
    math.pi,
    0.5 * math.pi,
    -1.5 * math.pi,
    1e5 * math.pi,
    1e16,
    -1e300,
    1.0 / 3.0,
)
BINARY: dict[str, tuple[Callable[[Any, Any], Any], Callable[[Any, Any], Any]]] = {
    "+": (lambda a, b: a + b, lambda a, b: a + b),
    "-": (lambda a, b: a - b, lambda a, b: a - b),
    "*": (lambda a, b: a * b, lambda a, b: a * b),
    "/": (lambda a, b: a / b, lambda a, b: a / b),
    "angle": (angle, lambda y, x: mp.atan2(y, x)),
}
UNARY: dict[str, tuple[Callable[[Intervals], Intervals], Callable[[Any], Any]]] = {
    "sine": (sine, mp.sin),
    "cosine": (cosine, mp.cos),
    "root": (root, mp.sqrt),
    "square": (lambda x: x.square(), lambda x: x * x),
    "whole": (whole, mp.floor),
}


def drawn(seed: int) -> Intervals:
    """Random and hostile intervals: of all sizes, of one number, across zero, next to hostile numbers."""
    random = np.random.default_rng(seed)
    middle = random.choice((1.0, -1.0), COUNT) * 10.0 ** random.uniform(-12, 4, COUNT)
    middle[::5] = random.choice(HOSTILE, len(middle[::5]))
    width = np.where(random.random(COUNT) < 0.3, 0.0, 10.0 ** random.uniform(-14, 1, COUNT)) * np.maximum(
        abs(middle), 1e-3
    )
    return Intervals(middle - width, middle + width)


def inside(x: Intervals, random: np.random.Generator) -> np.ndarray:
    """Numbers from intervals, often an end."""
    part = random.choice((0.0, 1.0, 0.5, random.random()), len(x.low))
    return np.clip(x.low + part * (x.high - x.low), x.low, x.high)


def encloses(found: Intervals, k: int, exact: Any) -> bool:
    return bool(mp.mpf(float(found.low[k])) <= exact <= mp.mpf(float(found.high[k])))


@pytest.mark.parametrize("name", BINARY)
def test_operations_of_two_intervals_enclose_100_digits(name: str) -> None:
    ours, exactly = BINARY[name]
    a, b, random = drawn(1), drawn(2), np.random.default_rng(3)
    with np.errstate(all="ignore"):
        found = ours(a, b)
    for k, (x, y) in enumerate(zip(inside(a, random), inside(b, random), strict=True)):
        if name == "/" and y == 0.0:
            continue
        assert encloses(found, k, exactly(mp.mpf(float(x)), mp.mpf(float(y)))), (name, x, y)


@pytest.mark.parametrize("name", UNARY)
def test_functions_of_an_interval_enclose_100_digits(name: str) -> None:
    ours, exactly = UNARY[name]
    a, random = drawn(4), np.random.default_rng(5)
    with np.errstate(all="ignore"):
        found = ours(a)
    for k, x in enumerate(inside(a, random)):
        if name == "root" and x < 0.0:
            continue
        assert encloses(found, k, exactly(mp.mpf(float(x)))), (name, x)


def test_bounds_of_waves_and_quotients_are_close() -> None:
    x = Intervals(np.array([0.1, 1.0, 3.0]), np.array([0.2, 2.0, 4.0]))
    found = sine(x)
    assert found.low == pytest.approx([math.sin(0.1), math.sin(1.0), math.sin(4.0)], abs=1e-14)
    assert found.high == pytest.approx([math.sin(0.2), 1.0, math.sin(3.0)], abs=1e-14)
    assert (1.0 / x).low == pytest.approx([5.0, 0.5, 0.25], rel=1e-15)


def test_nothing_is_known_where_a_function_jumps() -> None:
    x = Intervals(np.array([0.9]), np.array([1.1]))
    assert not np.isfinite(whole(x).low)[0]
    assert not np.isfinite(angle(x - 1.0, -x).low)[0]
    assert not np.isfinite((1.0 / (x - 1.0)).low)[0]


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("rise", RISES, ids=lambda rise: rise.type)
def test_rises_stay_within_their_bounds(rise: type, order: int) -> None:
    random = np.random.default_rng(6)
    low = random.uniform(-0.2, 1.1, 300)
    x = Intervals(low, low + 10.0 ** random.uniform(-9, -0.3, 300))
    found = curve(x, rise.shape, order)
    for part in (0.0, 0.3, 0.9, 1.0):
        values = np.array([curve_value(rise.shape, order, at) for at in (x.low + part * (x.high - x.low)).tolist()])
        assert (found.low - 1e-12 <= values).all()
        assert (values <= found.high + 1e-12).all()
    assert found.high[np.isfinite(found.high)].max() < 400.0


def test_a_derivative_is_not_known_across_a_jump_of_the_one_before() -> None:
    across = Intervals(np.array([-0.1]), np.array([0.1]))
    assert np.isfinite(curve(across, SimpleHarmonic.shape, 2).high)[0]
    assert not np.isfinite(curve(across, SimpleHarmonic.shape, 3).high)[0]


def test_without_outward_rounding_an_enclosure_would_be_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("_up", "_down"):
        monkeypatch.setattr(intervals, name, lambda x: x)
    with pytest.raises(AssertionError):
        test_operations_of_two_intervals_enclose_100_digits("+")


def test_constants_that_would_be_rounded_stay_operations() -> None:
    """d/dx of 0.1 x 0.3 is 0.1 times 0.3, not the double next to it."""
    graph = ExactGraph()
    x = graph.symbol("x")
    targets = (x * 0.1) * 0.3, (x * 0.5) * 3.0, 0.1 * x / 0.3 + 0.2 * graph.function("sin", graph.constant(1.0)) * x
    slopes = graph.derivative(targets, {x: graph.constant(1.0)})
    ten, thirty, fifth = (mp.mpf(value) for value in (0.1, 0.3, 0.2))
    exact = ten * thirty, mp.mpf(1.5), ten / thirty + fifth * mp.sin(1)
    for found, expected in zip(enclosed(slopes, {}, (1,)), exact, strict=True):
        assert found.low <= expected <= found.high
        assert found.high - found.low < 1e-14
    assert slopes[1].constant == 1.5
