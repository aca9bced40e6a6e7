"""Small dense linear algebra against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.solver.python.linear import (
    Singular,
    column_part,
    factor,
    lu_solve,
    qr_factor,
    qr_solve,
    reciprocal_condition,
    row_part,
)


@pytest.mark.parametrize("k", [1, 2, 3, 5, 8])
def test_solution_and_determinant_are_those_of_numpy(k: int) -> None:
    rng = np.random.default_rng(k)
    a, b = rng.normal(size=(k, k)), rng.normal(size=k)
    assert lu_solve(factor(a.tolist()), b.tolist()) == pytest.approx(np.linalg.solve(a, b).tolist(), abs=1e-12)
    rows = a / np.linalg.norm(a, axis=1, keepdims=True)
    assert factor(a.tolist()).determinant == pytest.approx(np.linalg.det(rows), abs=1e-13)


def test_least_squares_are_those_of_numpy() -> None:
    rng = np.random.default_rng(7)
    a, b = rng.normal(size=(6, 4)), rng.normal(size=6)
    x = qr_solve(qr_factor(a.tolist()), b.tolist())
    assert x == pytest.approx(np.linalg.lstsq(a, b, rcond=None)[0].tolist(), abs=1e-12)


@pytest.mark.parametrize(
    "matrix", [[[0.0, 0.0], [1.0, 1.0]], [[1.0, 0.0], [1.0, 0.0]], [[float("nan"), 1.0], [1.0, 1.0]]]
)
def test_matrix_without_a_pivot_is_singular(matrix: list[list[float]]) -> None:
    with pytest.raises(Singular):
        factor(matrix)


def test_part_of_a_matrix_is_its_shortest_row_or_column_over_the_usual_one() -> None:
    matrix = [[3.0, 4.0], [0.6, 0.8]]
    assert row_part(matrix, (5.0, 2.0)) == pytest.approx(0.5)
    assert row_part(matrix, (5.0, 0.5)) == 1.0
    assert column_part([[3.0, 1.0], [4.0, 0.0], [0.0, 0.0]], (10.0, 1.0)) == pytest.approx(0.5)


@pytest.mark.parametrize("k", [2, 3, 4])
def test_reciprocal_condition_is_that_of_the_equilibrated_matrix(k: int) -> None:
    a = np.random.default_rng(k).normal(size=(k, k))
    rows = a / np.linalg.norm(a, axis=1, keepdims=True)
    columns = rows / np.linalg.norm(rows, axis=0, keepdims=True)
    assert reciprocal_condition(a.tolist()) == pytest.approx(1.0 / np.linalg.cond(columns, 1), rel=1e-12)
    assert reciprocal_condition([[1.0] * k for _ in range(k)]) == pytest.approx(0.0, abs=1e-15)


def test_row_of_a_tall_matrix_that_vanishes_but_for_rounding_does_not_count_in_its_condition() -> None:
    a = np.random.default_rng(3).normal(size=(4, 3))
    a[3] = 0.0
    without = reciprocal_condition(a.tolist())
    a[3] = [1e-17, -3e-17, 2e-17]
    assert reciprocal_condition(a.tolist()) == pytest.approx(without, rel=1e-12)
    assert without == pytest.approx(1.0 / np.linalg.cond(np.linalg.qr(a[:3] / np.linalg.norm(a[:3], axis=0))[1], 1))
