"""What a certificate evaluates of a plan: rows along a predicted path, with their derivatives, on one graph."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import add, mul, neg, sub
from typing import TypeVar

from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import ExactGraph, Node, reachable, symbols

TIME = "time"
WAY = "way along a direction"
Key = TypeVar("Key")
_PRIME = 2**127 - 1
_EXACT: dict[str, Callable[..., int]] = {"+": add, "-": sub, "*": mul, "neg": neg}
ORDERS = 3  # derivatives along the predicted path, the last one for what the path leaves out


@dataclass(frozen=True)
class BlockFormulas:
    """Formulas of a solved block, over the driver, the unknowns of this and of earlier blocks, and the parameters.

    Attributes:
        names: The unknowns z.
        place: Of the first of them among all unknowns.
        rows: The residuals r and their first, second and third derivative along the predicted path.
        jacobian: dr/dz, row after row.
        earlier: dr/dz for the unknowns of earlier blocks on which it depends, by their places.
        parameters: dr/dp by the names of the parameters.
        rates: The same for the first derivative of r along the predicted path: by places, then by names.

    """

    names: tuple[str, ...]
    place: int
    rows: tuple[tuple[Node, ...], ...]
    jacobian: tuple[Node, ...]
    earlier: Mapping[int, tuple[Node, ...]]
    parameters: Mapping[str, tuple[Node, ...]]
    rates: Mapping[int | str, tuple[Node, ...]]

    @property
    def size(self) -> int:
        """How many unknowns it has."""
        return len(self.names)

    @property
    def is_tall(self) -> bool:
        """True if it has redundant rows."""
        return len(self.rows[0]) > len(self.names)


class PlanRows:
    """The rows of a plan on one graph; coordinates that rows give outright are replaced by their formulas.

    Args:
        plan: The plan.

    """

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.graph = ExactGraph()
        self._equals = _Equals(self.graph)
        self._given: dict[str, Node] = {}
        self._copies: dict[Node, Node] = {}

    def inlined(self, nodes: Sequence[Node]) -> list[Node]:
        """Return nodes of the plan as nodes of this graph."""
        for node in reachable(nodes):
            if node in self._copies:
                continue
            if node.op == "symbol":
                copied = self._given.get(node.name) or self.graph.symbol(node.name)
            else:
                copied = self.graph.copy(node, *(self._copies[arg] for arg in node.args))
            self._copies[node] = self._equals.first(copied)
        return [self._copies[node] for node in nodes]

    def gradient(self, nodes: Sequence[Node], name: str) -> tuple[Node, ...]:
        """Return the derivatives of nodes with respect to a symbol."""
        return tuple(self.graph.derivative(nodes, {self.graph.symbol(name): self.graph.constant(1.0)}))

    def solved(self) -> Iterator[tuple[Block, int, list[Node]]]:
        """Yield each block with unknowns, the place of its first unknown among all, and its residuals; once."""
        place = 0
        for block in self.plan.blocks:
            for name, motion in block.assigned:
                (self._given[name],) = self.inlined([motion[0]])
            if block.unknowns:
                yield block, place, self.inlined(block.residuals)
                place += len(block.unknowns)


class Formulas(PlanRows):
    """The formulas of a plan as functions of one number x: the value of its only driver, or the time of its run.

    Symbols are x and the unknowns by their contract names, the rates and accelerations of the predicted path by those
    of derivatives, and constants: the parameters, over time also the constants of laws. Coordinates that rows give
    outright are replaced by their formulas.

    Args:
        plan: The plan.
        over_time: True for the time of the run.
        varied: Names of the symbols of constants that are not numbers but intervals.

    Attributes:
        x: Name of x.
        unit_of_x: 1 rad, the mechanism's size, or 1 s.
        unknowns: Names of all unknowns, block after block.
        units: 1 rad or the mechanism's size for each of them.
        constants: Values of the constants.
        blocks: Blocks with unknowns.
        outputs: Each output with its first two derivatives.
        redundant: Redundant rows by name, relative to the size: of blocks that have some, all rows.

    """

    def __init__(self, plan: SolvePlan, *, over_time: bool = False, varied: Collection[str] = ()) -> None:
        super().__init__(plan)
        self.varied = varied
        self.constants = dict(plan.parameter_values)
        self._rates: dict[Node, Node] = {}
        if over_time:
            self.x, self.unit_of_x = TIME, 1.0
            self.constants |= {constant.name: constant.value for constant in plan.law_constants}
            for driver, law in zip(plan.drivers, plan.laws, strict=True):
                (self._given[driver.inputs[0]],) = self.inlined([law.position])
        else:
            self.x = plan.drivers[0].inputs[0]
            self.unit_of_x = 1.0 if plan.drivers[0].quantity.kind == "angle" else plan.size
        self._rates[self.graph.symbol(self.x)] = self.graph.constant(1.0)
        self.names: dict[str, tuple[str, str]] = {}
        for name in plan.unknowns:
            self._move(name, name.derivative(1), name.derivative(2))
        self.unknowns: tuple[str, ...] = plan.unknowns
        self.units = tuple(1.0 if name.is_angle else plan.size for name in plan.unknowns)
        self.blocks = tuple(self._block(block.unknowns, place, rows) for block, place, rows in self.solved())
        self.redundant = dict(zip(plan.watch_names, self.inlined([node for _, node in plan.watches]), strict=True))
        for block, formulas in zip((block for block in plan.blocks if block.unknowns), self.blocks, strict=True):
            if formulas.is_tall:
                self.redundant |= zip(block.row_names, formulas.rows[0], strict=True)
        self.outputs = tuple(self.along(self.inlined([motion.position for motion in plan.outputs_motion]), 2))

    def turned(self, number: int, direction: Sequence[float], at: Sequence[float]) -> Formulas:
        """Return the formulas near a pose as functions of the way along a direction, with the driver as an unknown.

            c . (z - z0) = x     in place of a given driver

        number: of the block, from 0; the blocks on which it depends are solved with it. direction: c for the unknowns
        of that block. at: z0 of these.
        """
        found = copy.copy(self)
        driver = self.plan.drivers[0].inputs
        found.x = WAY
        symbol = self.graph.symbol
        blocks = [self.blocks[k] for k in self.behind(number)]
        row = -symbol(WAY)
        for name, c, z in zip(blocks[-1].names, direction, at, strict=True):
            row = row + self.graph.constant(c) * (symbol(name) - self.graph.constant(z))
        found._rates = {**self._rates, symbol(WAY): self.graph.constant(1.0)}
        found.names = dict(self.names)
        found._move(*driver)
        places = [k for block in blocks for k in range(block.place, block.place + block.size)]
        found.unknowns = (driver[0], *(self.unknowns[k] for k in places))
        found.units = (self.unit_of_x, *(self.units[k] for k in places))
        rows = [*(node for block in blocks for node in block.rows[0]), row]
        found.blocks = (found._block(found.unknowns, 0, rows),)
        found.outputs = ()
        return found

    def behind(self, number: int) -> list[int]:
        """Return the numbers of a block and of those on which it depends, in the order of solving."""
        found = {number}
        for k in range(number, -1, -1):
            if k in found:
                found |= {self._block_at(place) for place in self.blocks[k].earlier}
        return sorted(found)

    def _block_at(self, place: int) -> int:
        return max(k for k, block in enumerate(self.blocks) if block.place <= place)

    def _move(self, name: str, rate: str, acceleration: str) -> None:
        symbol = self.graph.symbol
        self.names[name] = (rate, acceleration)
        self._rates |= {symbol(name): symbol(rate), symbol(rate): symbol(acceleration)}

    def along(self, nodes: Sequence[Node], orders: int = ORDERS) -> list[tuple[Node, ...]]:
        """Return each node with its derivatives along the predicted path."""
        rows = [tuple(nodes)]
        for _ in range(orders):
            rows.append(tuple(self.graph.derivative(rows[-1], self._rates)))
        return list(zip(*rows, strict=True))

    def _block(self, names: tuple[str, ...], place: int, residuals: Sequence[Node]) -> BlockFormulas:
        rows = tuple(zip(*self.along(residuals), strict=True))
        columns = [self.gradient(residuals, name) for name in names]
        met = {symbol.name for symbol in symbols(residuals)}
        until = [(k, name) for k, name in enumerate(self.unknowns[: place + len(names)]) if name in met]
        varied = [name for name in self.varied if name in met]
        return BlockFormulas(
            names=names,
            place=place,
            rows=rows,
            jacobian=tuple(entry for row in zip(*columns, strict=True) for entry in row),
            earlier=_moving({k: self.gradient(residuals, name) for k, name in until if k < place}),
            parameters=_moving({name: self.gradient(residuals, name) for name in varied}),
            rates=_moving(
                {k: self.gradient(rows[1], name) for k, name in until}
                | {name: self.gradient(rows[1], name) for name in varied}
            ),
        )


class _Equals:
    """Finds nodes that are equal in exact arithmetic, such as the rounding errors of sums and products, which are 0.

    Each node has a value modulo a prime; symbols and functions have random ones. Sums, products and quotients of
    different values by formulas of degree d agree by chance with a probability of d / p (Schwartz, 1980): less than
    1e-30.
    """

    def __init__(self, graph: ExactGraph) -> None:
        self._random = random.Random(1980)  # noqa: S311  no secrets
        self._values: dict[Node, int] = {}
        zero = graph.constant(0.0)
        self._values[zero] = 0
        self._nodes: dict[int, Node] = {0: zero}

    def first(self, node: Node) -> Node:
        """Return the first node that is equal to a node, whose arguments were all asked for before."""
        value = self._values.get(node)
        if value is None:
            value = self._values[node] = self._value(node)
        return self._nodes.setdefault(value, node)

    def _value(self, node: Node) -> int:
        if node.constant is not None:
            top, bottom = node.constant.as_integer_ratio()
            return top * pow(bottom, -1, _PRIME) % _PRIME
        values = [self._values[self.first(arg)] for arg in node.args]
        if node.op == "/":
            return values[0] * pow(values[1], -1, _PRIME) % _PRIME if values[1] else self._random.randrange(1, _PRIME)
        operation = _EXACT.get(node.op)
        return operation(*values) % _PRIME if operation else self._random.randrange(1, _PRIME)


def _moving(gradients: Mapping[Key, tuple[Node, ...]]) -> dict[Key, tuple[Node, ...]]:
    """Return the gradients that are not zero everywhere."""
    return {key: nodes for key, nodes in gradients.items() if any(node.constant != 0.0 for node in nodes)}
