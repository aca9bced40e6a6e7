"""Whether motions go round, by compiled and by Python arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.motion import History, quintic
from kinfmu.motion.quintic import ranges, use_compiled
from kinfmu.motion.samples import goes_round

X = np.linspace(0.0, 2.0 * np.pi, 38)


@pytest.fixture(params=["compiled", "numpy"])
def arithmetic(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    use_compiled()
    monkeypatch.setattr(quintic, "_compiled", quintic._compiled if request.param == "compiled" else [])


def sine(frequency: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    f = frequency
    return np.sin(f * X), f * np.cos(f * X), -f * f * np.sin(f * X)


def history_of(rows: tuple[np.ndarray, np.ndarray, np.ndarray]) -> History:
    return History(X, *(np.array(row) for row in rows))


@pytest.mark.usefixtures("arithmetic")
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("place", [0, 5, 36, 37])
@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("is_angle", [True, False])
def test_a_design_with_an_unknown_sample_does_not_go_round(
    order: int, place: int, unknown: float, is_angle: bool
) -> None:
    rows = tuple(np.array([row, row, 2.0 * row]) for row in sine(1.0))
    rows[order][1, place] = unknown
    other = history_of(tuple(np.array([row, row, row]) for row in sine(2.0)))  # type: ignore[arg-type]
    assert goes_round([(history_of(rows), is_angle), (other, False)]).tolist() == [True, False, True]  # type: ignore[arg-type]


@pytest.mark.usefixtures("arithmetic")
def test_the_last_sample_is_compared_with_the_first_one_of_each_quantity() -> None:
    turning = (X, np.ones_like(X), np.zeros_like(X))
    still = (np.ones_like(X), np.zeros_like(X), np.zeros_like(X))
    assert goes_round([(history_of(turning), True)])
    assert not goes_round([(history_of(turning), False)])
    assert not goes_round([(history_of(still), False)])
    assert goes_round([(history_of(still), False), (history_of(sine(3.0)), False)])
    assert not goes_round([(history_of(sine(1.0)), False), (history_of(sine(0.5)), False)])
    value, rate, acceleration = sine(1.0)
    for off, goes in ((1e-10, True), (1e-8, False)):
        assert goes_round([(history_of((value + off * X, rate, acceleration)), False)]) == goes


@pytest.mark.usefixtures("arithmetic")
def test_of_designs_without_gaps_a_few_samples_decide_unless_they_are_too_small() -> None:
    """A motion that the few samples miss is measured by all of them."""
    large, _, _ = sine(1.0)
    bump = np.zeros_like(X)
    bump[3] = 1.0
    off = 1e-10 * X
    values = np.array([large + off, bump + off, large + 10.0 * X, off * 0.0, large])
    values[4, 5] = np.nan
    history, is_known = history_of((values, 0.0 * values, 0.0 * values)), np.array([True, True, True, True, False])
    expected = [True, True, False, False, False]
    assert goes_round([(history, False)]).tolist() == expected
    assert goes_round([(history, False)], is_known).tolist() == expected
    assert goes_round([(History(X, *(row[:1] for row in history.rows)), False)], is_known[:1]).tolist() == [True]


@pytest.mark.usefixtures("arithmetic")
@pytest.mark.parametrize("count", [1, 7, 8, 9, 361])
def test_ranges_are_the_smallest_and_the_largest_number_of_each_row(count: int) -> None:
    table = np.random.default_rng(count).normal(size=(5, 2, count + 3))[:, :, :count]
    low, high = ranges(table)
    np.testing.assert_array_equal(low, table.min(axis=-1))
    np.testing.assert_array_equal(high, table.max(axis=-1))
