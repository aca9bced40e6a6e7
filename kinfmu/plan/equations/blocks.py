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


def ordered_blocks(meets: Sequence[Sequence[int]], column_count: int, of_drivers: int = 0) -> Ordered:
    """Return the blocks: rows matched to columns, then strongly connected components (Dulmage-Mendelsohn, fine).

    Ties go to the earlier row, so that equal input gives equal order. Written in Python, since scipy takes longer to
    import than the largest mechanism to order.

    meets: The columns that each row meets. of_drivers: Number of rows at the end that are never to spare where a row
    before them could be.
    """
    row_of = _matched(meets, [*range(len(meets) - of_drivers, len(meets)), *range(len(meets) - of_drivers)])
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


def _matched(meets: Sequence[Sequence[int]], rows: Sequence[int]) -> dict[int, int]:
    """Return columns with their rows, as many as possible; a row that comes earlier in `rows` is matched rather.

    Each row takes the nearest free column: each row on the shortest path to it passes its column on.
    """
    row_of: dict[int, int] = {}
    column_of: dict[int, int] = {}
    closed: set[int] = set()  # columns from which no path leads to a free one, neither now nor later
    for start in rows:
        reached_by: dict[int, int] = {}  # the row that reaches a column first
        free: int | None = None
        reached = [start]
        for row in reached:
            new = [column for column in meets[row] if column not in reached_by and column not in closed]
            reached_by.update(dict.fromkeys(new, row))
            free = next((column for column in new if column not in row_of), None)
            if free is not None:
                break
            reached += [row_of[column] for column in new]
        else:
            closed.update(reached_by)
        while free is not None:
            row = row_of[free] = reached_by[free]
            passed_on = column_of.get(row)
            column_of[row], free = free, passed_on
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
