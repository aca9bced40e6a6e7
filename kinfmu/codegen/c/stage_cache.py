"""The stage cache: numbers of the position stage that later functions read and do not compute again.

Which numbers these are is known when the later functions are written; only then has each one its place. Until then a
place is written '<3:7>': number 7 of those that a unit of run 3 keeps.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import accumulate
from typing import Protocol

from kinfmu.codegen.lists import Lists, UnitRun
from kinfmu.plan.equations.graph import Node


class Unit(Protocol):
    """The writer of a kind's functions, as the stage cache sees it."""

    @property
    def positions(self) -> Sequence[Node]:
        """Nodes of the position stage."""

    def cached(self, node: Node) -> int:
        """Return the place of a node among the numbers that a unit keeps; add it if it is new."""

    def cache_size(self) -> int:
        """Return how many numbers a unit keeps."""


class StageCache:
    """The numbers that the units of a plan keep for later functions, run after run and unit after unit.

    units: by the label of their kind; nodes: those that functions of the whole model can read, with the number of their
    run. Only runs of one unit have such nodes: in longer runs a node does not determine the unit.
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
        """Return the place of a node, to be filled in by `placed`."""
        number = self.nodes[node]
        return f"<{number}:{self._unit(self._runs[number - 1]).cached(node)}>"

    def placed(self, lines: Iterable[str]) -> list[str]:
        """Return statements with numbers for the places that `place` returned."""

        def number(match: re.Match[str]) -> str:
            return str(self._starts[int(match[1]) - 1] + int(match[2]))

        return [re.sub(r"<(\d+):(\d+)>", number, line) for line in lines]

    def start(self, number: int, k: str) -> str:
        """Return where the numbers of unit k of a run begin: '4 + k * 3'."""
        start, count = self._starts[number - 1], self._unit(self._runs[number - 1]).cache_size()
        return f"{start}" if k == "0" else f"{start} + {k if k.isalnum() else f'({k})'} * {count}"

    def __len__(self) -> int:
        return self._starts[-1]

    @cached_property
    def _starts(self) -> list[int]:
        """Return where each run's numbers begin; known once all functions that read some are written."""
        return [0, *accumulate(len(run.members) * self._unit(run).cache_size() for run in self._runs)]

    def _unit(self, run: UnitRun) -> Unit:
        return self._units[run.kind.label]
