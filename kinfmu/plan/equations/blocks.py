"""The order of solving: blocks of rows and coordinates, each needing only blocks before it."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from typing import NamedTuple


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

    meets: the columns that each row meets. Ties go to the earlier row, so that equal input gives equal order. Written
    in Python, since scipy takes longer to import than the largest mechanism to order.
    """
    row_of = _matched(meets)
    column_of = {row: column for column, row in row_of.items()}
    if not len(meets) == column_count == len(row_of):
        return Ordered(
            (),
            tuple(row for row in range(len(meets)) if row not in column_of),
            tuple(column for column in range(column_count) if column not in row_of),
        )
    needs = [[row_of[column] for column in columns] for columns in meets]
    order = _topological(_strongly_connected(needs), needs)
    return Ordered(tuple((tuple(rows), tuple(sorted(column_of[row] for row in rows))) for rows in order))


def _matched(meets: Sequence[Sequence[int]]) -> dict[int, int]:
    """Return columns with their rows, as many as possible; earlier rows come before later ones.

    Each row in turn takes the nearest free column, along the shortest path of rows that each pass their column on.
    """
    row_of: dict[int, int] = {}
    column_of: dict[int, int] = {}
    for row in range(len(meets)):
        reached_by: dict[int, int] = {}  # the row that reaches a column first
        free: int | None = None
        reached = [row]
        for taker in reached:
            for column in meets[taker]:
                if column in reached_by:
                    continue
                reached_by[column] = taker
                if column not in row_of:
                    free = column
                    break
                reached.append(row_of[column])
            if free is not None:
                break
        while free is not None:
            taker = row_of[free] = reached_by[free]
            passed_on = column_of.get(taker)
            column_of[taker], free = free, passed_on
    return row_of


def _strongly_connected(needs: Sequence[Sequence[int]]) -> Mapping[int, Sequence[int]]:
    """Return the rows that need one another, in the order of the file, by the first of them (Gabow's algorithm)."""
    number: dict[int, int] = {}  # in the order of the depth-first search
    done: set[int] = set()
    members: dict[int, list[int]] = {}
    pending: list[int] = []  # rows whose component is not complete
    begins: list[int] = []  # of the components that pending rows may be in
    for root in range(len(needs)):
        path = [] if root in done else [(root, iter(needs[root]))]
        while path:
            row, ahead = path[-1]
            if row not in number:
                number[row] = len(number)
                pending.append(row)
                begins.append(row)
            for needed in ahead:
                if needed not in number:
                    path.append((needed, iter(needs[needed])))
                    break
                while needed not in done and number[begins[-1]] > number[needed]:
                    begins.pop()
            else:
                path.pop()
                if begins[-1] == row:
                    begins.pop()
                    rows = [pending.pop()]
                    while rows[-1] != row:
                        rows.append(pending.pop())
                    done.update(rows)
                    members[min(rows)] = sorted(rows)
    return members


def _topological(members: Mapping[int, Sequence[int]], needs: Sequence[Sequence[int]]) -> list[Sequence[int]]:
    """Return components so that each comes after those it needs; ties go to the earlier row of the file."""
    first_of = {row: first for first, rows in members.items() for row in rows}
    before: dict[int, set[int]] = {
        first: {first_of[needed] for row in rows for needed in needs[row]} - {first} for first, rows in members.items()
    }
    after: dict[int, set[int]] = {first: set() for first in members}
    for first, needed in before.items():
        for other in needed:
            after[other].add(first)
    ready = [first for first, needed in before.items() if not needed]
    heapq.heapify(ready)
    order = []
    while ready:
        first = heapq.heappop(ready)
        order.append(members[first])
        for later in after[first]:
            before[later].discard(first)
            if not before[later]:
                heapq.heappush(ready, later)
    return order
