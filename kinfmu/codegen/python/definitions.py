"""Rates and accelerations of assigned coordinates: written where something needs them, each once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from kinfmu.codegen.writer import Writer, identifier
from kinfmu.equations.graph import Node, symbols


class Definitions:
    """Formulas by the names that they define, in the order of evaluation."""

    def __init__(self, formulas: Mapping[str, Node]) -> None:
        self._formulas = formulas
        self._order = {name: k for k, name in enumerate(formulas)}

    def lines(self, writer: Writer, wanted: Iterable[str], done: set[str]) -> list[str]:
        """Statements for the names that the wanted ones are made of and that are not done yet.

        done: names already written; it grows.
        """
        needed: set[str] = set()
        stack = [name for name in wanted if name in self._formulas]
        while stack:
            name = stack.pop()
            if name not in needed and name not in done:
                needed.add(name)
                stack += [symbol.name for symbol in symbols([self._formulas[name]]) if symbol.name in self._formulas]
        done |= needed
        lines = []
        for name in sorted(needed, key=self._order.__getitem__):
            lines += writer.statements([self._formulas[name]])
            lines.append(f"{identifier(name)} = {writer.expression(self._formulas[name])}")
        return lines
