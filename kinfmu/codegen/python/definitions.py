"""Definitions of names by formulas, in order; formulas folded for a single driver at speed 1 and acceleration 0."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence

from kinfmu.codegen.writer import Writer, identifier
from kinfmu.plan import Block
from kinfmu.plan.equations.graph import Node, reachable, symbols

_OPERATIONS: dict[str, Callable[..., Node]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
}


class UnitSpeed:
    """Right sides and formulas of a plan whose only driver has speed 1 and acceleration 0.

    formulas: rates and accelerations of assigned coordinates by name, in the order of evaluation.
    """

    def __init__(self, speed: str, acceleration: str, formulas: Mapping[str, Node]) -> None:
        self._given = {speed: 1.0, acceleration: 0.0}
        self.formulas: dict[str, Node] = {}
        for name, node in formulas.items():
            (folded,) = self._folded([node])
            self.formulas[name] = folded
            if folded.constant is not None:
                self._given[name] = folded.constant

    def velocity(self, block: Block) -> tuple[Node, ...]:
        """Return the block's right side for velocities, folded."""
        return tuple(self._folded(block.velocity))

    def acceleration(self, block: Block) -> tuple[Node, ...]:
        """Return the block's right side for accelerations, folded."""
        return tuple(self._folded(block.acceleration))

    def _folded(self, targets: Sequence[Node]) -> list[Node]:
        """Return the targets with numbers in place of the given symbols, simplified by the graph."""
        new: dict[Node, Node] = {}
        for node in reachable(targets):
            if node.op == "symbol" and node.name in self._given:
                new[node] = node.graph.constant(self._given[node.name])
            elif node.op in _OPERATIONS:
                new[node] = _OPERATIONS[node.op](*(new[arg] for arg in node.args))
            elif node.args:
                new[node] = node.graph.function(node.op, *(new[arg] for arg in node.args), value=node.value)
            else:
                new[node] = node
        return [new[target] for target in targets]


class Definitions:
    """Formulas by the names that they define, in the order of evaluation."""

    def __init__(self, formulas: Mapping[str, Node]) -> None:
        self._formulas = formulas
        self._order = {name: k for k, name in enumerate(formulas)}

    def lines(self, writer: Writer, wanted: Iterable[str], done: set[str]) -> list[str]:
        """Return statements for the names that the wanted ones are made of, without those in `done`.

        done: names already written; the new ones are added.
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
