"""The interface as a slave needs it, and how its lists are read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any, NamedTuple

UNKNOWN_ERROR = 1e30  # of solver.error_q, _qd, _qdd: an error without an estimate; many hosts cannot record an infinity


class PartLayout(NamedTuple):
    """Variables that are computed together: their type (Real, or another), names, and start values if any."""

    name: str
    type: str
    variables: tuple[str, ...]
    starts: tuple[Any, ...] = ()


class Layout(NamedTuple):
    """The interface of a slave: variables in order of value references, and the token of the FMU."""

    token: str
    start_time: float  # [s]
    parts: tuple[PartLayout, ...]


class Places:
    """Part and place of the variable of a value reference; value references count the variables from 1."""

    def __init__(self, layout: Layout) -> None:
        self._places = [(k, i) for k, part in enumerate(layout.parts) for i in range(len(part.variables))]
        self.layout = layout

    def real(self, vr: int) -> tuple[int, int] | tuple[None, int]:
        """Return part and place of a Real variable, or (None, 0) if the value reference is of no Real variable."""
        if 1 <= vr <= len(self._places):
            part, place = self._places[vr - 1]
            if self.layout.parts[part].type == "Real":
                return part, place
        return None, 0

    def number(self, name: str) -> int:
        """Return the value reference of a variable."""
        return 1 + [variable for part in self.layout.parts for variable in part.variables].index(name)

    def name(self, vr: int) -> str:
        """Return the name of the variable, or an empty text."""
        if 1 <= vr <= len(self._places):
            part, place = self._places[vr - 1]
            return self.layout.parts[part].variables[place]
        return ""


Numbers = tuple[float, ...]

NOT_A_NUMBER = math.nan
MOTION = "values", "rates", "accelerations"  # parts that are computed together, as the part "motion"


Computer = Callable[[Any], Numbers]  # computes the numbers of a part at a pose


# How to read a list of Real variables: the numbers of some parts make a row, of which places are picked. A plain tuple,
# which is unpacked in every read:
Fetch = tuple[
    list[int],  # value references
    tuple[tuple[str, Computer | None], ...],  # parts, each with what computes it; None: it is read as it is set
    Callable[[Numbers], Sequence[float]] | None,  # picks the places; None: all of them
]


def plan_fetch(references: Places, vrs: Sequence[int], computers: Mapping[str, Computer]) -> Fetch:
    """Return how to read a list of value references; those of no Real variable are read from the part "no_number"."""
    layout = references.layout
    places = [references.real(vr) for vr in vrs]
    parts = list(dict.fromkeys([part for part, _ in places if part is not None]))
    offsets: dict[int, int] = {}
    width = 0
    for part in parts:
        offsets[part] = width
        width += len(layout.parts[part].variables)
    indices = [width if part is None else offsets[part] + place for part, place in places]
    names = _joined([layout.parts[part].name for part in parts])
    if width in indices:
        names.append("no_number")
    return list(vrs), tuple([(name, computers.get(name)) for name in names]), _picker(indices, width)


def _joined(names: list[str]) -> list[str]:
    """Return the parts' names, with "motion" in place of those that it reads together."""
    count = len(MOTION)
    for k in range(len(names)):
        if tuple(names[k : k + count]) == MOTION:
            return [*names[:k], "motion", *names[k + count :]]
    return names


def _picker(indices: list[int], width: int) -> Callable[[Numbers], Sequence[float]] | None:
    """Return what picks places of a row of that width: a slice for neighbours, None for the whole row."""
    if indices == list(range(width)):
        return None
    if not indices:
        return itemgetter(slice(0, 0))
    if indices == list(range(indices[0], indices[0] + len(indices))):
        return itemgetter(slice(indices[0], indices[-1] + 1))
    return itemgetter(*indices)
