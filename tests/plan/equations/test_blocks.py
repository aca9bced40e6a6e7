"""The order of solving against scipy's graphs, and which rows and columns are reported where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

from kinfmu.plan.equations.blocks import ordered_blocks


def incidence(meets: list[list[int]], column_count: int) -> csr_matrix:
    table = np.zeros((len(meets), column_count))
    for row, columns in enumerate(meets):
        table[row, columns] = 1.0
    return csr_matrix(table)


@pytest.mark.parametrize("seed", range(40))
def test_blocks_are_the_strong_components_and_need_only_earlier_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 25))
    table = rng.random((count, count)) < rng.choice([0.03, 0.1, 0.3])
    table[range(count), rng.permutation(count)] = True
    meets = [rng.permutation(np.flatnonzero(row)).tolist() for row in table]
    blocks = ordered_blocks(meets, count).blocks
    graph = incidence(meets, count)
    match = maximum_bipartite_matching(graph, perm_type="column")
    _, component = connected_components(graph[:, match], connection="strong")
    assert sorted(rows for rows, _ in blocks) == sorted(
        tuple(np.flatnonzero(component == label).tolist()) for label in set(component.tolist())
    )
    solved: set[int] = set()
    for rows, unknown in blocks:
        assert list(unknown) == sorted(match[list(rows)].tolist())
        solved |= {*unknown}
        assert {column for row in rows for column in meets[row]} <= solved


@pytest.mark.parametrize("seed", range(40))
def test_as_few_rows_and_columns_as_possible_are_left_over(seed: int) -> None:
    rng = np.random.default_rng(seed)
    row_count, column_count = rng.integers(0, 14, 2).tolist()
    table = rng.random((row_count, column_count)) < rng.choice([0.1, 0.2, 0.4])
    meets = [np.flatnonzero(row).tolist() for row in table]
    order = ordered_blocks(meets, column_count)
    match = maximum_bipartite_matching(incidence(meets, column_count), perm_type="column")
    matched = int((match >= 0).sum())
    assert (len(order.unmatched_rows), len(order.unmatched_columns)) == (row_count - matched, column_count - matched)
    assert bool(order.blocks) is (0 < row_count == column_count == matched)


def test_the_later_row_is_left_over_unless_it_is_that_of_a_driver() -> None:
    order = ordered_blocks([[0], [1, 2], [0], [1], [2], [4]], 6)
    assert (order.blocks, order.unmatched_rows, order.unmatched_columns) == ((), (2, 4), (3, 5))
    order = ordered_blocks([[0], [1, 2], [0], [1], [2], [4]], 6, of_drivers=2)
    assert (order.blocks, order.unmatched_rows, order.unmatched_columns) == ((), (2, 3), (3, 5))


def test_without_rows_there_is_nothing_to_solve() -> None:
    assert ordered_blocks([], 0) == ((), (), ())
