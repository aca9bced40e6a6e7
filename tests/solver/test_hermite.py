"""Two-sided Hermite interpolation."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu.solver.python.span import Hermite, weights

NODES = (-2.0, -1.0, 1.0, 2.0)


@given(st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12), st.floats(-2.0, 2.0))
def test_polynomial_of_degree_eleven_is_met_exactly(coefficients: list[float], x: float) -> None:
    def exact(x: float) -> tuple[float, float, float]:
        return (
            sum(c * x**k for k, c in enumerate(coefficients)),
            sum(k * c * x ** (k - 1) for k, c in enumerate(coefficients) if k),
            sum(k * (k - 1) * c * x ** (k - 2) for k, c in enumerate(coefficients) if k > 1),
        )

    read = Hermite(NODES, tuple(map(exact, NODES)))(x)
    for value, wanted in zip(read, exact(x), strict=True):
        assert value == pytest.approx(wanted, abs=1e-8)


def test_weights_give_the_value_of_the_polynomial() -> None:
    samples = tuple((math.sin(x), math.cos(x), -math.sin(x)) for x in NODES)
    by = weights(NODES, 0.3)
    value = sum(w * f for row, sample in zip(by, samples, strict=True) for w, f in zip(row, sample, strict=True))
    assert value == pytest.approx(Hermite(NODES, samples)(0.3)[0], abs=1e-13)
    assert value == pytest.approx(math.sin(0.3), abs=1e-7)
