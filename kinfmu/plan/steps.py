"""Steps on a graph: assignments and linear solves, and how what they give changes in some directions.

A direction is a parameter, or a driver's value. Derivatives along it follow block after block by the chain rule.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

from kinfmu.mechanism.parameters import parameter_values
from kinfmu.plan.block import Block
from kinfmu.plan.equations.graph import Graph, Node, reachable, symbols
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.trace import parameter_symbol


class Assignment(NamedTuple):
    """A symbol's name and its formula."""

    name: str
    node: Node


class LinearSolve(NamedTuple):
    """Solutions x of J x = -b for several columns b; names: of the entries of x, column after column."""

    jacobian: tuple[tuple[Node, ...], ...]
    columns: tuple[tuple[Node, ...], ...]
    names: tuple[tuple[str, ...], ...]


Step = Assignment | LinearSolve


class Stage(Protocol):
    """Steps, and the nodes that are wanted in the end."""

    @property
    def steps(self) -> Sequence[Step]: ...

    @property
    def results(self) -> Sequence[Node]: ...


class Tracing:
    """The steps found so far, and how each symbol changes in each direction: with a parameter, or with a driver.

    Args:
        graph: Where the steps are traced.
        changes: For each direction, derivatives of symbols.
        constants: Names of law constants, whose symbols are renamed.

    """

    def __init__(self, graph: Graph, changes: list[dict[Node, Node]], constants: Collection[str]) -> None:
        self.graph = graph
        self.steps: list[Step] = []
        self.changes = changes
        self._copies: dict[Node, Node] = {}
        self._constants = constants

    def copied(self, nodes: Sequence[Node]) -> list[Node]:
        """Return nodes of the plan as nodes of this graph."""
        for node in reachable(nodes):
            if node not in self._copies:
                if node.op == "symbol" and node.name in self._constants:
                    self._copies[node] = self.graph.symbol(law_symbol(node.name))
                else:
                    self._copies[node] = self.graph.copy(node, *(self._copies[arg] for arg in node.args))
        return [self._copies[node] for node in nodes]

    def by_direction(self, nodes: Sequence[Node]) -> list[list[Node]]:
        """Return the total derivatives of nodes, a list for each direction."""
        return [self.graph.derivative(nodes, changes) for changes in self.changes]

    def laws(self, plan: SolvePlan) -> None:
        """Add how driver values and speeds change with the constants of their laws."""
        for driver, law in zip(plan.drivers, plan.laws, strict=True):
            for name, derivatives in zip(
                driver.inputs, zip(*self.by_direction(self.copied(law[1:3])), strict=True), strict=False
            ):
                self._add(name, derivatives)

    def block(self, block: Block) -> Iterator[tuple[str, tuple[Node, ...]]]:
        """Add a block's steps; yield the names of rows that least squares may leave open, with their gaps."""
        jacobian, residuals = self.jacobian(block), self.copied(block.residuals)
        self.solve(jacobian, residuals, block.unknowns)
        rates = [name.derivative(1) for name in block.unknowns]
        moving = [self.graph.symbol(name) for name in rates]
        rows = []
        for entries, rest in zip(jacobian, self.copied(block.velocity), strict=True):
            for entry, rate in zip(entries, moving, strict=True):
                rest = entry * rate + rest
            rows.append(rest)
        self.solve(jacobian, rows, rates)
        for name, motion in block.assigned:
            for order in (0, 1):
                self._assign(name.derivative(order), motion[order])
        if len(residuals) > len(block.unknowns):
            yield from zip(block.row_names, zip(*self.by_direction(residuals), strict=True), strict=True)

    def positions(self, block: Block) -> None:
        """Add the steps to the derivatives of a block's coordinates, and to all that its rows give outright."""
        self.solve(self.jacobian(block), self.copied(block.residuals), block.unknowns)
        self.assigned(block)

    def assigned(self, block: Block) -> None:
        """Add the steps to the coordinates that a block's rows give outright, and to their derivatives."""
        for name, (position, *derivatives) in block.assigned:
            self._assign(name, position)
            for order, node in enumerate(self.copied(derivatives), start=1):
                self.steps.append(Assignment(name.derivative(order), node))

    def jacobian(self, block: Block) -> tuple[tuple[Node, ...], ...]:
        flat, k = self.copied(block.entries), len(block.unknowns)
        return tuple(tuple(flat[row * k : (row + 1) * k]) for row in range(len(block.residuals)))

    def _assign(self, name: str, node: Node) -> None:
        """Add the formula of a coordinate or rate, and its derivatives."""
        (copied,) = self.copied([node])
        self.steps.append(Assignment(name, copied))
        self._add(name, [derivatives[0] for derivatives in self.by_direction([copied])])

    def _add(self, name: str, derivatives: Sequence[Node]) -> None:
        """Add a symbol's derivatives: a step for each that is a formula."""
        symbol = self.graph.symbol(name)
        for number, (changes, node) in enumerate(zip(self.changes, derivatives, strict=True)):
            if not node.args:  # a constant or a symbol
                changes[symbol] = node
            else:
                self.steps.append(Assignment(derivative_name(name, number), node))
                changes[symbol] = self.graph.symbol(derivative_name(name, number))

    def solve(self, jacobian: tuple[tuple[Node, ...], ...], rows: Sequence[Node], unknowns: Sequence[str]) -> None:
        """Add the solution of J x = -b, with b the derivatives of rows; x are the derivatives of unknowns."""
        numbered = [
            (number, tuple(column))
            for number, column in enumerate(self.by_direction(rows))
            if any(node.constant != 0.0 for node in column)
        ]
        if not numbered or not unknowns:
            return
        names = [tuple(derivative_name(name, number) for name in unknowns) for number, _ in numbered]
        solved = self.solutions(jacobian, [column for _, column in numbered], names)
        for (number, _), nodes in zip(numbered, solved, strict=True):
            for name, node in zip(unknowns, nodes, strict=True):
                self.changes[number][self.graph.symbol(name)] = node

    def solutions(
        self,
        matrix: tuple[tuple[Node, ...], ...],
        columns: Sequence[tuple[Node, ...]],
        names: Sequence[tuple[str, ...]],
    ) -> list[list[Node]]:
        """Add the solutions x of A x = -b for columns b; return them as symbols of the names given."""
        if len(matrix) == len(matrix[0]) <= 2:
            self.steps += [
                Assignment(name, node)
                for of_column, nodes in zip(names, self._cramer(matrix, columns), strict=True)
                for name, node in zip(of_column, nodes, strict=True)
            ]
        else:
            self.steps.append(LinearSolve(matrix, tuple(columns), tuple(names)))
        return [[self.graph.symbol(name) for name in of_column] for of_column in names]

    def _cramer(self, jacobian: Sequence[Sequence[Node]], columns: Sequence[Sequence[Node]]) -> list[list[Node]]:
        """Return -J^-1 b of one or two unknowns for each column b."""
        if len(jacobian) == 1:
            return [[-(b / jacobian[0][0])] for (b,) in columns]
        (p, q), (r, s) = jacobian
        per_determinant = 1.0 / (p * s - q * r)
        return [[(q * b - s * a) * per_determinant, (r * a - p * b) * per_determinant] for a, b in columns]


def law_symbol(name: str) -> str:
    """Return the name of a law constant's symbol: crank.speed and the input crank_speed are two numbers in code."""
    return f"{name}.law"


def derivative_name(name: str, number: int) -> str:
    """Return the name of a symbol's derivative in a direction, a parameter or a driver, by its number."""
    return f"{name}.by{number}"


def needed_steps(results: Sequence[Node], steps: Sequence[Step]) -> tuple[Step, ...]:
    """Return the steps that results depend on, in order."""
    wanted = {symbol.name for symbol in symbols(results)}
    kept: list[Step] = []
    for step in reversed(steps):
        if isinstance(step, Assignment):
            if step.name not in wanted:
                continue
            wanted |= {symbol.name for symbol in symbols([step.node])}
            kept.append(step)
            continue
        pairs = [(column, names) for column, names in zip(step.columns, step.names, strict=True) if wanted & set(names)]
        if pairs:
            columns, names = zip(*pairs, strict=True)
            kept.append(LinearSolve(step.jacobian, columns, names))
            nodes = [node for row in (*step.jacobian, *columns) for node in row]
            wanted |= {symbol.name for symbol in symbols(nodes)}
    return tuple(kept[::-1])


@dataclass(frozen=True, eq=False)
class SensitivitySteps:
    """What is computed for the sensitivities of some outputs, in order.

    Symbols that no step gives are unknowns and their rates, driver values and speeds, parameters and `time`, under
    their contract names, and law constants under that of `law_symbol`.

    Attributes:
        steps: Assignments and linear solves.
        positions: One node for each output.
        rates: Likewise.
        positions_by: One row for each output, with one node for each parameter.
        rates_by: Likewise.
        gaps: For each parameter, derivatives of rows that must stay closed, relative to the size.
        gap_names: Names of these rows.

    """

    steps: tuple[Step, ...]
    positions: tuple[Node, ...]
    rates: tuple[Node, ...]
    positions_by: tuple[tuple[Node, ...], ...]
    rates_by: tuple[tuple[Node, ...], ...]
    gaps: tuple[tuple[Node, ...], ...]
    gap_names: tuple[str, ...]

    @property
    def results(self) -> list[Node]:
        """All nodes that are wanted in the end."""
        rows = (self.positions, self.rates, *self.positions_by, *self.rates_by, *self.gaps)
        return [node for row in rows for node in row]


def sensitivity_steps(
    plan: SolvePlan, outputs: Sequence[str], parameters: Sequence[str], *, by_law: bool, given: Collection[str] = ()
) -> SensitivitySteps:
    """Return the steps to the derivatives of outputs with respect to parameters.

    Args:
        plan: The plan; its graph is copied, so that its own nodes and its code stay as they are.
        outputs: Names of outputs of the plan.
        parameters: Names of parameters of the plan, and of law constants.
        by_law: The drivers follow their laws, which depend on law constants and parameters; else driver values are
            given and do not change.
        given: Parameters with values of their own; others that are written as expressions follow from these.

    Returns:
        The steps that the outputs, and the rows that must stay closed, depend on.

    """
    graph = Graph()
    tracing = Tracing(graph, _changes(graph, plan, parameters, given), {one.name for one in plan.law_constants})
    if by_law:
        tracing.laws(plan)
    gaps = [gap for block in plan.blocks for gap in tracing.block(block)]
    watches = tracing.copied([node for _, node in plan.watches])
    gaps += zip(plan.watch_names, zip(*tracing.by_direction(watches), strict=True), strict=True)
    chosen = {motion.name: motion for motion in plan.outputs_motion}
    positions = tracing.copied([chosen[name].position for name in outputs])  # type: ignore[index]  # names are strings
    rates = tracing.copied([chosen[name].rate for name in outputs])  # type: ignore[index]
    found = SensitivitySteps(
        steps=(),
        positions=tuple(positions),
        rates=tuple(rates),
        positions_by=tuple(zip(*tracing.by_direction(positions), strict=True)),
        rates_by=tuple(zip(*tracing.by_direction(rates), strict=True)),
        gaps=tuple(zip(*(nodes for _, nodes in gaps), strict=True)),
        gap_names=tuple(name for name, _ in gaps),
    )
    return replace(found, steps=needed_steps(found.results, tracing.steps))


def _changes(
    graph: Graph, plan: SolvePlan, parameters: Sequence[str], given: Collection[str]
) -> list[dict[Node, Node]]:
    """Return how the symbols of parameters and law constants change with each of those chosen."""
    written = plan.mechanism.parameters
    own = {parameter.name: graph.symbol(parameter_symbol(parameter.name)) for parameter in plan.parameters}
    one = graph.constant(1.0)
    changes: list[dict[Node, Node]] = []
    for name in parameters:
        if name not in own:  # a law constant
            changes.append({graph.symbol(law_symbol(name)): one})
            continue
        free = {key: node for key, node in own.items() if key in (name, *given) or not written[key].expression}
        found = parameter_values(written, free)
        values = [graph.lift(found[key]) for key in own]
        derivatives = graph.derivative(values, {own[name]: one})
        changes.append(
            {node: change for node, change in zip(own.values(), derivatives, strict=True) if change.constant != 0.0}
        )
    return changes


def scale_of(plan: SolvePlan, name: str) -> float:
    """Return by how much a parameter may well change: the size for a length, else 1."""
    kinds: Mapping[str, str] = {parameter.name: parameter.quantity.kind for parameter in plan.parameters}
    return plan.size if kinds.get(name) == "length" else 1.0
