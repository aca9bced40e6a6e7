"""The order of solving: blocks of rows and coordinates, each needing only blocks before it."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np


class Ordered(NamedTuple):
    """The order of solving, or the reason why there is none.

    blocks: (rows, columns) in the order of solving; unmatched_rows, unmatched_columns: rows to spare and columns that
    no row determines; then there are no blocks.
    """

    blocks: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    unmatched_rows: tuple[int, ...] = ()
    unmatched_columns: tuple[int, ...] = ()


def ordered_blocks(meets: Sequence[Sequence[int]], column_count: int) -> Ordered:
    """Return the blocks: rows matched to columns, then strongly connected components (Dulmage-Mendelsohn, fine).

    meets: the columns that each row meets. Ties go to the earlier row, so that equal input gives equal order.
    """
    from scipy.sparse import csr_matrix  # here, since few commands need it and it takes long to import
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    row_number = np.repeat(np.arange(len(meets)), [len(columns) for columns in meets])
    column = np.array([k for columns in meets for k in columns], dtype=int)
    incidence = csr_matrix((np.ones(len(column)), (row_number, column)), shape=(len(meets), column_count))
    match = maximum_bipartite_matching(incidence, perm_type="column")  # column of each row, -1 if none
    if len(meets) != column_count or (match < 0).any():
        matched = set(match.tolist())
        return Ordered(
            (),
            tuple(int(k) for k in np.flatnonzero(match < 0)),
            tuple(k for k in range(column_count) if k not in matched),
        )
    owner = np.empty(column_count, dtype=int)
    owner[match] = np.arange(len(meets))
    needed = owner[column]
    needs = csr_matrix((np.ones(len(column)), (row_number, needed)), shape=(len(meets), len(meets)))
    _, component = connected_components(needs, connection="strong")
    members: dict[int, list[int]] = {}
    for k, label in enumerate(component.tolist()):
        members.setdefault(label, []).append(k)
    order = _topological(component.tolist(), row_number.tolist(), needed.tolist(), members)
    return Ordered(tuple((tuple(members[k]), tuple(sorted(int(match[r]) for r in members[k]))) for k in order))


def _topological(
    component: Sequence[int], row_number: Iterable[int], needed: Iterable[int], members: Mapping[int, Sequence[int]]
) -> list[int]:
    """Return components so that each comes after those it needs; ties go to the earlier row of the file."""
    before: dict[int, set[int]] = {label: set() for label in members}
    after: dict[int, set[int]] = {label: set() for label in members}
    for a, b in zip(row_number, needed, strict=True):
        if component[a] != component[b]:
            before[component[a]].add(component[b])
            after[component[b]].add(component[a])
    ready = [(members[label][0], label) for label, needs in before.items() if not needs]
    heapq.heapify(ready)
    order = []
    while ready:
        _, label = heapq.heappop(ready)
        order.append(label)
        for later in sorted(after[label]):
            before[later].discard(label)
            if not before[later]:
                heapq.heappush(ready, (members[later][0], later))
    return order
