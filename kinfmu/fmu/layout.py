"""What a slave must know of its interface. Travels inside the FMU: standard library only."""

from __future__ import annotations

from typing import Any, NamedTuple

UNKNOWN_ERROR = 1e30  # of solver.error_q, _qd, _qdd: an error without an estimate; many hosts cannot record an infinity


class PartLayout(NamedTuple):
    """Variables that are computed together: their names, and start values where they have some."""

    name: str
    variables: tuple[str, ...]
    starts: tuple[Any, ...] = ()


class Layout(NamedTuple):
    """What a slave must know of its interface: variables in order of value references, and the content token."""

    token: str
    start_time: float  # [s]
    parts: tuple[PartLayout, ...]


class Places:
    """Where the variable of a value reference is found: value references count the variables of a layout from 1."""

    _NOT_REAL = ("counts", "ok", "drive", "rate_source", "message")

    def __init__(self, layout: Layout) -> None:
        self._places = [(k, i) for k, part in enumerate(layout.parts) for i in range(len(part.variables))]
        self.layout = layout

    def real(self, vr: int) -> tuple[int, int] | tuple[None, int]:
        """Part and place of a Real variable, (None, 0) if the value reference is none of those."""
        if 1 <= vr <= len(self._places):
            part, place = self._places[vr - 1]
            if self.layout.parts[part].name not in self._NOT_REAL:
                return part, place
        return None, 0

    def name(self, vr: int) -> str:
        """Name of the variable, empty if there is none."""
        if 1 <= vr <= len(self._places):
            part, place = self._places[vr - 1]
            return self.layout.parts[part].variables[place]
        return ""
