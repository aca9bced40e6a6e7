"""How a list of Real variables is read, worked out once. Travels inside the FMU: standard library only."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import NamedTuple

from kinfmu.fmu.layout import Places

Row = tuple[float, ...]
Reader = Callable[[], Row]  # reads a part of the list of variables

NOT_A_NUMBER = math.nan
MOTION = "values", "rates", "accelerations"  # parts that one reader, "motion", reads in one go


class Fetch(NamedTuple):
    """How to read one list of Real variables: read one part and the others into a row, pick these places."""

    read: Reader
    others: tuple[Reader, ...]
    pick: Callable[[Row], Sequence[float]] | None  # None: all of them


def plan_fetch(references: Places, vrs: Sequence[int], reader: Callable[[str], Reader]) -> Fetch:
    """How these value references are read; those that are no Real variable give NaN.

    reader: gives what reads a part, or "motion", by its name.
    """
    layout = references.layout
    places = [references.real(vr) for vr in vrs]
    parts = sorted({part for part, _ in places if part is not None})
    offsets: dict[int, int] = {}
    width = 0
    for part in parts:
        offsets[part] = width
        width += len(layout.parts[part].variables)
    indices = [width if part is None else offsets[part] + place for part, place in places]
    readers = [reader(name) for name in _joined([layout.parts[part].name for part in parts])]
    if width in indices or not readers:
        readers.append(_no_number)
    return Fetch(readers[0], tuple(readers[1:]), _picker(indices, width))


def _joined(names: list[str]) -> list[str]:
    """The parts' names, with "motion" in the place of those that it reads in one go."""
    count = len(MOTION)
    for k in range(len(names)):
        if tuple(names[k : k + count]) == MOTION:
            return [*names[:k], "motion", *names[k + count :]]
    return names


def _no_number() -> Row:
    return (NOT_A_NUMBER,)


def _picker(indices: list[int], width: int) -> Callable[[Row], Sequence[float]] | None:
    """Pick these places of a row of that width: a slice if they are neighbours, None if they are all."""
    if indices == list(range(width)):
        return None
    if not indices:
        return itemgetter(slice(0, 0))
    if indices == list(range(indices[0], indices[0] + len(indices))):
        return itemgetter(slice(indices[0], indices[-1] + 1))
    return itemgetter(*indices)
