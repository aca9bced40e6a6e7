"""Statements for nodes: a node used once is written inline, a node used again gets a name."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

from kinfmu.plan import Block
from kinfmu.plan.equations.graph import FUNCTIONS, Node, reachable
from kinfmu.solver.python.curve import CurveData

_LEVEL = {"+": 1, "-": 1, "neg": 2, "*": 3, "/": 3}  # how strongly operators bind: a weaker operand gets parentheses
_ATOM = 4
_LONGEST_INLINE = 72  # characters; longer expressions get a name


@lru_cache(maxsize=1 << 16)
def identifier(name: str) -> str:
    """Return 'coupler_phi' for 'coupler.phi'."""
    return re.sub(r"\W", "_", name)


class Names:
    """Names of nodes in one generated module: symbols under their own, intermediate values numbered in order.

    curves: names of the constants that hold the data of curves; functions: names of functions called in place of sin,
    cos and so on; "sincos" is the one that computes both at once: f(x, &sine, &cosine).
    """

    def __init__(
        self,
        reserved: Iterable[str] = (),
        curves: Mapping[CurveData, str] | None = None,
        functions: Mapping[str, str] | None = None,
    ) -> None:
        self.curves = curves or {}
        self.functions = functions or {}
        self._numbered: dict[Node, str] = {}
        self._reserved = {identifier(name) for name in reserved}
        self._count = 0

    def of(self, node: Node) -> str:
        """Return the name of a node, a new one at the first call."""
        if node.op == "symbol":
            return identifier(node.name)
        if node not in self._numbered:
            readable = f"{node.op}_{identifier(node.args[0].name)}" if node.args[0].op == "symbol" else ""
            if node.op in ("sin", "cos") and readable and readable not in self._reserved:
                self._numbered[node] = readable
            else:
                self._count += 1
                self._numbered[node] = f"t{self._count}"
        return self._numbered[node]

    @classmethod
    def of_blocks(
        cls,
        blocks: Sequence[Block],
        curves: Mapping[CurveData, str] | None = None,
        functions: Mapping[str, str] | None = None,
    ) -> Names:
        """Return names that call what a block gives outright after its coordinate, after the first if it is two."""
        names = cls((name for block in blocks for name in block.coordinates), curves, functions)
        for name, motion in (assigned for block in blocks for assigned in block.assigned):
            if motion[0].args:
                names._numbered.setdefault(motion[0], identifier(name))
        return names


class Writer:
    """The writer of one function's statements, given which nodes are known when it starts."""

    def __init__(self, names: Names, known: Iterable[Node], keep: Iterable[Node] = ()) -> None:
        self.names = names
        self.known = set(known)  # already held in variables
        self.keep = set(keep)  # named even if used once, because other functions read them
        self.used: dict[Node, None] = {}  # known nodes that the statements read, in order
        self._known_at_start = frozenset(self.known)

    def statements(self, targets: Sequence[Node]) -> list[str]:
        """Return assignments after which `expression` can return every target."""
        new = [node for node in reachable(targets, self.known) if node.args and node not in self.known]
        uses = Counter(arg for node in new for arg in node.args)
        uses.update(targets)
        inline = {node for node in new if uses[node] == 1 and node not in self.keep and node.op not in FUNCTIONS}
        lines: list[str] = []
        text: dict[Node, tuple[str, int]] = {}
        others = self._others(new)
        for node in new:
            if node in self.known:  # computed together with the other one of its angle
                text[node] = (self.names.of(node), _ATOM)
                continue
            if node in others:
                lines.append(self._pair(node, others[node], text))
                continue
            text[node] = self._operation(node, text)
            if node not in inline or len(text[node][0]) > _LONGEST_INLINE:
                inline.discard(node)
                lines.append(f"{self.names.of(node)} = {text[node][0]}")
                self.known.add(node)
                text[node] = (self.names.of(node), _ATOM)
        self._inline = {node: text[node] for node in inline}
        return lines

    def _others(self, new: Sequence[Node]) -> dict[Node, Node]:
        """Return for sines and cosines the other one of the same angle, if one call computes both."""
        if "sincos" not in self.names.functions:
            return {}
        found = {(node.op, node.args[0]): node for node in new if node.op in ("sin", "cos")}
        pairs = [(node, found.get(("cos" if op == "sin" else "sin", angle))) for (op, angle), node in found.items()]
        return {node: other for node, other in pairs if other is not None}

    def formulas(self, targets: Sequence[Node]) -> tuple[list[str], list[str]]:
        """Return statements, and after them each target as an expression."""
        return self.statements(targets), [self.expression(node) for node in targets]

    def _pair(self, node: Node, other: Node, text: dict[Node, tuple[str, int]]) -> str:
        """Return the statement that computes both."""
        sine, cosine = (node, other) if node.op == "sin" else (other, node)
        for one in (sine, cosine):
            self.known.add(one)
            text[one] = (self.names.of(one), _ATOM)
        angle, _ = self._reference(node.args[0], text)
        return f"{self.names.functions['sincos']}({angle}, &{self.names.of(sine)}, &{self.names.of(cosine)})"

    def independent(self, targets: Sequence[Node], moving: Iterable[Node]) -> list[Node]:
        """Return the largest parts of the targets without the symbols `moving`, which a loop need not repeat."""
        moves: set[Node] = set(moving)
        parts: dict[Node, None] = {}
        for node in reachable(targets, self.known):
            if any(arg in moves for arg in node.args):
                moves.add(node)
                parts.update((arg, None) for arg in node.args if arg.args and arg not in moves)
        return [part for part in parts if part not in moves and part not in self.known]

    def expression(self, node: Node) -> str:
        """Return a target as an expression, after its statements."""
        return self._reference(node, self._inline)[0]

    def _reference(self, node: Node, text: Mapping[Node, tuple[str, int]]) -> tuple[str, int]:
        """Return a node as a number, name or expression, and its level in _LEVEL; text: those of inline nodes."""
        if node.constant is not None:
            return repr(node.constant), _ATOM if node.constant >= 0.0 else _LEVEL["neg"]
        if node in self._known_at_start or node.op == "symbol":
            self.used[node] = None
            return self.names.of(node), _ATOM
        if node in self.known:
            return self.names.of(node), _ATOM
        return text[node]

    def _operation(self, node: Node, text: Mapping[Node, tuple[str, int]]) -> tuple[str, int]:
        """Return the expression of an operation, and its level."""
        parts = [self._reference(arg, text) for arg in node.args]
        if node.op == "curve":
            data, order = node.curve
            return f"curve({self.names.curves[data]}, {order}, {parts[0][0]})", _ATOM
        if node.op in FUNCTIONS:
            name = self.names.functions.get(node.op, node.op)
            return f"{name}({', '.join(text for text, _ in parts)})", _ATOM
        level = _LEVEL[node.op]
        if node.op == "neg":
            return f"-{_wrapped(parts[0], level + 1)}", level
        # Operations of one level stay in the order of the formula, which is the order of rounding.
        return f"{_wrapped(parts[0], level)} {node.op} {_wrapped(parts[1], level + 1)}", level


def _wrapped(part: tuple[str, int], level: int) -> str:
    return part[0] if part[1] >= level else f"({part[0]})"
