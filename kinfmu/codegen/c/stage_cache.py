"""What units hand on: numbers of the position stage that later functions take, and do not compute again.

Which these are shows when the later functions are written; only then is it known where each one stands. Until then its
place is written '<3:7>': number 7 of what the units of run 3 hand on.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import accumulate
from typing import Protocol

from kinfmu.codegen.alike import Run
from kinfmu.codegen.lists import Lists
from kinfmu.equations.graph import Node


class Unit(Protocol):
    """The functions of a kind of units, as far as they are looked at here."""

    @property
    def positions(self) -> Sequence[Node]:
        """Nodes of the position stage."""

    def handed_on(self, node: Node) -> int:
        """Place of a node among the numbers that a unit hands on, from now on if not before."""

    def room(self) -> int:
        """How many numbers a unit hands on."""


class HandedOn:
    """What the units of a plan hand on, run after run and unit after unit.

    units: by the label of their kind; nodes: what functions of the whole model can take from a unit, with the number of
    its run, a run of one: of several nobody can tell which one is meant.
    """

    def __init__(self, lists: Lists, units: Mapping[str, Unit]) -> None:
        self._runs = lists.runs
        self._units = units
        self.nodes = {
            node: number
            for number, run in lists.numbered()
            if len(run.members) == 1 and not run.kind.constants
            for node in units[run.kind.label].positions
            if node.args and node not in lists.derived
        }

    def place(self, node: Node) -> str:
        """Where one of the nodes will stand."""
        number = self.nodes[node]
        return f"<{number}:{self._unit(self._runs[number - 1]).handed_on(node)}>"

    def placed(self, lines: Iterable[str]) -> list[str]:
        """Statements with the numbers of places that `place` told."""

        def told(match: re.Match[str]) -> str:
            return str(self._starts[int(match[1]) - 1] + int(match[2]))

        return [re.sub(r"<(\d+):(\d+)>", told, line) for line in lines]

    def start(self, number: int, k: str) -> str:
        """Where the numbers of unit k of a run begin: '4 + k * 3'."""
        start, room = self._starts[number - 1], self._unit(self._runs[number - 1]).room()
        return f"{start}" if k == "0" else f"{start} + {k if k.isalnum() else f'({k})'} * {room}"

    def __len__(self) -> int:
        return self._starts[-1]

    @cached_property
    def _starts(self) -> list[int]:
        """Where each run's numbers begin: known when all functions that take some are written."""
        return [0, *accumulate(len(run.members) * self._unit(run).room() for run in self._runs)]

    def _unit(self, run: Run) -> Unit:
        return self._units[run.kind.label]
