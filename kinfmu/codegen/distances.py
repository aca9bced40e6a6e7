"""Rows of drivers of distances: d.d - u^2, whose target must not be negative and has no slope at 0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kinfmu.measures import DistanceBetween
from kinfmu.plan import Block, SolvePlan


class DistanceRow(NamedTuple):
    """A driver of a distance, by its number, and its row in a solved block; scale: of the row, per mechanism size."""

    driver: int
    block: int
    row: int
    scale: float


def distance_rows(plan: SolvePlan, solved: Sequence[Block]) -> tuple[DistanceRow, ...]:
    """Return the rows of the plan's drivers of distances; solved: the blocks that need Newton."""
    found = []
    for number, driver in enumerate(plan.mechanism.drivers):
        measure = driver.measured()
        if isinstance(measure, DistanceBetween):
            name = f"{driver.name}.{driver.noun}"
            found += [
                DistanceRow(number, k, block.row_names.index(name), measure.scale(plan.size) * plan.size)
                for k, block in enumerate(solved)
                if name in block.row_names
            ]
    return tuple(found)
