"""The joints' formulas traced into a graph of arithmetic, with derivatives taken on the graph.

Equal expressions are one node. Simplifications keep every bit of the value (up to the sign of a zero), so that traced
code and direct evaluation agree exactly. Nodes are numbered in the order of creation, arguments first: all passes run
along the numbers, nothing recurses.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Collection, Container, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

from kinfmu.mechanism.quantities.arithmetic import atan2_like, cos, curve, floor, sin, sqrt
from kinfmu.solver.python.curve import CurveData
from kinfmu.solver.python.curve import curve as curve_value
from kinfmu.units import CoordinateName

Content = float | str | tuple[CurveData, int] | None


class Node:
    """A number in the graph: a constant, a symbol, or an operation on earlier nodes."""

    __slots__ = ("args", "constant", "graph", "id", "op", "value")

    def __init__(self, graph: Graph, op: str, args: tuple[Node, ...], value: Content, number: int) -> None:
        self.graph = graph
        self.op = op  # "constant", "symbol", "+", "-", "*", "/", "neg", or a key of FUNCTIONS
        self.args = args
        self.value = value  # of a constant its float, of a symbol its name, of a curve its data and order
        self.constant: float | None = value if op == "constant" else None  # type: ignore[assignment]  # a float
        self.id = number

    @property
    def name(self) -> str:
        """Name of a symbol: a CoordinateName, an InputName, or of another kind."""
        return self.value  # type: ignore[return-value]  # symbols hold their names

    @property
    def coordinate(self) -> CoordinateName | None:
        """The coordinate of a symbol; None for other nodes."""
        return self.value if isinstance(self.value, CoordinateName) else None

    @property
    def curve(self) -> tuple[CurveData, int]:
        """Data and order of derivative of a curve."""
        return self.value  # type: ignore[return-value]  # curves hold these

    def next_derivative(self) -> Node:
        """The curve's derivative of the next order, at the same argument."""
        data, order = self.curve
        return self.graph.function("curve", *self.args, value=(data, order + 1))

    def __repr__(self) -> str:
        return str(self.value) if not self.args else f"{self.op}({', '.join(map(repr, self.args))})"

    def __add__(self, other: Any) -> Node:
        a, b = self, self.graph.lift(other)
        if a.constant == 0.0:
            return b
        if b.constant == 0.0:
            return a
        if a.constant is not None and b.constant is not None:
            return self.graph.of_constants("+", a, b)
        if b.op == "neg":
            return a - b.args[0]
        if a.op == "neg":
            return b - a.args[0]
        return self.graph.node("+", *_numbered(a, b))

    def __sub__(self, other: Any) -> Node:
        a, b = self, self.graph.lift(other)
        if b.constant == 0.0:
            return a
        if a.constant == 0.0:
            return -b
        if a is b:
            return self.graph.constant(0.0)
        if a.constant is not None and b.constant is not None:
            return self.graph.of_constants("-", a, b)
        if b.op == "neg":
            return a + b.args[0]
        if a.op == "neg":
            return -(a.args[0] + b)
        return self.graph.node("-", a, b)

    def __rsub__(self, other: Any) -> Node:
        return self.graph.lift(other) - self

    def __neg__(self) -> Node:
        if self.constant is not None:
            return self.graph.constant(-self.constant)
        if self.op == "neg":
            return self.args[0]
        if self.op == "-":
            return self.args[1] - self.args[0]
        return self.graph.node("neg", self)

    def __mul__(self, other: Any) -> Node:
        a, b = _numbered(self, self.graph.lift(other))
        for x, y in ((a, b), (b, a)):
            if x.constant is None and x.op != "neg":
                continue
            if x.constant == 0.0:
                return x
            if x.constant == 1.0:
                return y
            if x.constant == -1.0:
                return -y
            if x.op == "neg":
                return -(x.args[0] * y)
        if a.constant is not None and b.constant is not None:
            return self.graph.of_constants("*", a, b)
        return self.graph.node("*", a, b)

    def __truediv__(self, other: Any) -> Node:
        a, b = self, self.graph.lift(other)
        if a.constant == 0.0 or b.constant == 1.0:
            return a
        if a.constant is not None and b.constant is not None:
            return self.graph.of_constants("/", a, b)
        if a.op == "neg":
            return -(a.args[0] / b)
        if b.constant == -1.0:
            return -a
        return self.graph.node("/", a, b)

    def __rtruediv__(self, other: Any) -> Node:
        return self.graph.lift(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


def _numbered(a: Node, b: Node) -> tuple[Node, Node]:
    """Return two nodes in the order of their numbers."""
    return (a, b) if a.id <= b.id else (b, a)


class Graph:
    """Owner of nodes; equal expressions are the same node."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Node] = {}

    def node(self, op: str, *args: Node) -> Node:
        return self._intern(op, args, None)

    def constant(self, value: float) -> Node:
        return self._intern("constant", (), float(value) + 0.0)  # + 0.0: one zero

    def symbol(self, name: str) -> Node:
        return self._intern("symbol", (), name)

    def lift(self, x: Any) -> Node:
        """Return a node of this graph for a node or a number."""
        return x if isinstance(x, Node) else self.constant(x)

    def copy(self, node: Node, *args: Node) -> Node:
        """Return an operation of another graph on nodes of this one, not simplified."""
        return self._intern(node.op, args, node.value)

    def _intern(self, op: str, args: tuple[Node, ...], value: Content) -> Node:
        key = (op, value, args)
        node = self._nodes.get(key)
        if node is None:
            node = self._nodes[key] = Node(self, op, args, value, len(self._nodes))
        return node

    def function(self, name: str, *args: Node, value: Content = None) -> Node:
        """Return one of FUNCTIONS of nodes; `value`: data and order of a curve."""
        if all(arg.constant is not None for arg in args):
            return self.of_constants(name, *args, value=value)
        return self._intern(name, args, value)

    def of_constants(self, op: str, *args: Node, value: Content = None) -> Node:
        """Return an operation on constants: a constant again."""
        return self.constant(_result(op, args, value))

    def derivative(
        self, targets: Sequence[Node], rates: Mapping[Node, Node], still: Collection[Node] = ()
    ) -> list[Node]:
        """Return derivatives of the targets if symbols move at the given rates; those in `still` do not move.

        A symbol without a rate does not move either.
        """
        zero, one = self.constant(0.0), self.constant(1.0)
        d: dict[Node, Node] = {}
        for node in reachable(targets):
            if not node.args:
                d[node] = zero if node in still else rates.get(node, zero)
                continue
            a, b = node.args[0], node.args[-1]
            if node.op in _OPERATORS and d[a] is zero and d[b] is zero:  # most nodes depend on few symbols
                d[node] = zero
            elif node.op == "+":
                d[node] = d[a] + d[b]
            elif node.op == "-":
                d[node] = d[a] - d[b]
            elif node.op == "neg":
                d[node] = -d[a]
            elif node.op == "*":
                d[node] = d[a] * b + a * d[b]
            elif node.op == "/":
                d[node] = (d[a] - node * d[b]) / b
            elif node.op == "sin":
                d[node] = self.function("cos", a) * d[a]
            elif node.op == "cos":
                d[node] = -(self.function("sin", a) * d[a])
            elif node.op == "atan2":  # of y and x: (x y' - y x') / (x^2 + y^2)
                turned = b * d[a] - a * d[b]
                d[node] = turned / (b * b + a * a)
            elif node.op == "floor":
                d[node] = zero
            elif node.op == "curve":
                d[node] = node.next_derivative() * d[a]
            else:  # sqrt
                d[node] = d[a] / (node * (one + one))
        return [d[target] for target in targets]


class ExactGraph(Graph):
    """A graph whose operations on constants are constants only where nothing is rounded."""

    def of_constants(self, op: str, *args: Node, value: Content = None) -> Node:
        if op in _RATIONAL:
            result = _result(op, args, value)
            if math.isfinite(result) and _RATIONAL[op](*(Fraction(arg.constant or 0.0) for arg in args)) == result:
                return self.constant(result)
        return self._intern(op, args, value)


def reachable(targets: Iterable[Node], known: Container[Node] = ()) -> list[Node]:
    """Return the targets and all nodes they are made of, arguments first; nothing that known ones are made of."""
    found: dict[int, Node] = {}
    stack = list(targets)
    while stack:
        node = stack.pop()
        if node.id not in found:
            found[node.id] = node
            if node not in known:
                stack.extend(node.args)
    return [found[number] for number in sorted(found)]


def evaluate(targets: Sequence[Node], values: Mapping[str, float]) -> list[float]:
    """Return numbers for the targets, given a number for each symbol by name; used by plans, not at run time."""
    return [value for (value,) in evaluate_all(targets, {name: (value,) for name, value in values.items()}, 1)]


def evaluate_all(targets: Sequence[Node], values: Mapping[str, Sequence[float]], count: int) -> list[Sequence[float]]:
    """Return `count` numbers for each target, given as many for each symbol by name."""
    at: dict[Node, Sequence[float]] = {}
    for node in reachable(targets):
        if node.op == "constant":
            at[node] = (float(node.constant or 0.0),) * count
        elif node.op == "symbol":
            at[node] = values[node.name]
        else:
            at[node] = list(map(_operation(node.op, node.value), *(at[arg] for arg in node.args)))
    return [at[target] for target in targets]


def _operation(op: str, value: Content) -> Callable[..., float]:
    """Return an operation on numbers; `value`: data and order of a curve."""
    return partial(curve_value, *value) if isinstance(value, tuple) else _OPERATIONS[op]


def _result(op: str, args: Sequence[Node], value: Content) -> float:
    return _operation(op, value)(*(arg.constant or 0.0 for arg in args))


_RATIONAL: dict[str, Callable[..., Fraction]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
_OPERATORS = frozenset(("+", "-", "*", "/", "neg"))
FUNCTIONS = ("sin", "cos", "sqrt", "floor", "atan2", "curve")
_OPERATIONS: dict[str, Callable[..., float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
    "sin": math.sin,
    "cos": math.cos,
    "sqrt": math.sqrt,
    "floor": floor,
    "atan2": math.atan2,
}


def symbols(targets: Iterable[Node]) -> list[Node]:
    """Return the symbols that the targets are made of, in the order of their numbers."""
    return [node for node in reachable(targets) if node.op == "symbol"]


def _traced(name: str) -> Callable[[Node], Node]:
    return lambda x: x.graph.function(name, x)


for _name, _function in (("sin", sin), ("cos", cos), ("sqrt", sqrt), ("floor", floor)):
    _function.register(Node, _traced(_name))


@curve.register
def _(x: Node, data: CurveData, order: int = 0) -> Node:
    return x.graph.function("curve", x, value=(data, order))


@atan2_like.register
def _(like: Node, y: Node | float, x: Node | float) -> Node:
    return like.graph.function("atan2", like.graph.lift(y), like.graph.lift(x))
