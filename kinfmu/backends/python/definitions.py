"""Rates and accelerations of assigned coordinates: written where something needs them, each once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from kinfmu.backends.python.writer import Writer, identifier
from kinfmu.equations.graph import Node, symbols


class Definition(NamedTuple):
    """Names that become known together, the names that they are made of, and the statements that do it."""

    names: tuple[str, ...]
    needs: tuple[str, ...]
    write: Callable[[Writer], list[str]]


def formula(name: str, node: Node) -> Definition:
    """A name that a node defines."""

    def write(writer: Writer) -> list[str]:
        return [*writer.statements([node]), f"{identifier(name)} = {writer.expression(node)}"]

    return Definition((name,), tuple(symbol.name for symbol in symbols([node])), write)


class Definitions:
    """Definitions in the order of evaluation."""

    def __init__(self, ordered: Sequence[Definition]) -> None:
        self._ordered = ordered
        self._home = {name: k for k, definition in enumerate(ordered) for name in definition.names}

    def lines(self, writer: Writer, wanted: Iterable[str], done: set[int]) -> list[str]:
        """Statements for the definitions that the wanted names are made of and that are not done yet.

        done: numbers of definitions already written; it grows.
        """
        needed: set[int] = set()
        stack = [self._home[name] for name in wanted if name in self._home]
        while stack:
            k = stack.pop()
            if k not in needed and k not in done:
                needed.add(k)
                stack += [self._home[name] for name in self._ordered[k].needs if name in self._home]
        done |= needed
        return [line for k in sorted(needed) for line in self._ordered[k].write(writer)]
