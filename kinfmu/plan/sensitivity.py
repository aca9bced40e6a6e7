"""Sensitivities of a plan: derivatives of its outputs with respect to parameters, as a list of steps on a graph.

A block gives its unknowns z by r(z, w, p) = 0, with w from earlier blocks and drivers. So for each parameter, block
after block, by the chain rule on the graph:

    J z_p  = -r_p                  r_p: total derivative of the rows with z at rest
    J zd_p = -(J zd + v)_p         v: the block's velocity column; total derivative with zd at rest

J is the block's Jacobian. A block with redundant rows is solved by least squares; what is left open of J z_p = -r_p is
a gap, as is the derivative of a watch: a parameter with gaps cannot change by itself. Haug (1989), chapter 3, gives J
and the equations of velocity; this is their derivative by the implicit function theorem.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from kinfmu.equations.graph import Graph, Node, reachable, symbols
from kinfmu.mechanism.parameters import parameter_values
from kinfmu.plan.block import Block
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
    tracing = _Tracing(plan, parameters, given)
    if by_law:
        tracing.laws(plan)
    gaps = [gap for block in plan.blocks for gap in tracing.block(block)]
    watches = tracing.copied([node for _, node in plan.watches])
    gaps += zip(plan.watch_names, zip(*tracing.by_parameter(watches), strict=True), strict=True)
    chosen = {motion.name: motion for motion in plan.outputs_motion}
    positions = tracing.copied([chosen[name].position for name in outputs])  # type: ignore[index]  # names are strings
    rates = tracing.copied([chosen[name].rate for name in outputs])  # type: ignore[index]
    found = SensitivitySteps(
        steps=(),
        positions=tuple(positions),
        rates=tuple(rates),
        positions_by=tuple(zip(*tracing.by_parameter(positions), strict=True)),
        rates_by=tuple(zip(*tracing.by_parameter(rates), strict=True)),
        gaps=tuple(zip(*(nodes for _, nodes in gaps), strict=True)),
        gap_names=tuple(name for name, _ in gaps),
    )
    return _with_steps(found, tracing.steps)


class _Tracing:
    """The steps found so far, and how each symbol changes with each parameter."""

    def __init__(self, plan: SolvePlan, parameters: Sequence[str], given: Collection[str]) -> None:
        self.graph = Graph()
        self.steps: list[Step] = []
        self._copies: dict[Node, Node] = {}
        self._constants = {constant.name for constant in plan.law_constants}
        written = plan.mechanism.parameters
        own = {parameter.name: self.graph.symbol(parameter_symbol(parameter.name)) for parameter in plan.parameters}
        one = self.graph.constant(1.0)
        self._changes: list[dict[Node, Node]] = []
        for name in parameters:
            if name not in own:  # a law constant
                self._changes.append({self.graph.symbol(law_symbol(name)): one})
                continue
            free = {key: node for key, node in own.items() if key in (name, *given) or not written[key].expression}
            found = parameter_values(written, free)
            values = [self.graph.lift(found[key]) for key in own]
            derivatives = self.graph.derivative(values, {own[name]: one})
            self._changes.append(
                {node: change for node, change in zip(own.values(), derivatives, strict=True) if change.constant != 0.0}
            )

    def copied(self, nodes: Sequence[Node]) -> list[Node]:
        """Return nodes of the plan as nodes of this graph."""
        for node in reachable(nodes):
            if node not in self._copies:
                if node.op == "symbol" and node.name in self._constants:
                    self._copies[node] = self.graph.symbol(law_symbol(node.name))
                else:
                    self._copies[node] = self.graph.copy(node, *(self._copies[arg] for arg in node.args))
        return [self._copies[node] for node in nodes]

    def by_parameter(self, nodes: Sequence[Node]) -> list[list[Node]]:
        """Return the total derivatives of nodes, a list for each parameter."""
        return [self.graph.derivative(nodes, changes) for changes in self._changes]

    def laws(self, plan: SolvePlan) -> None:
        """Add how driver values and speeds change with the constants of their laws."""
        for driver, law in zip(plan.drivers, plan.laws, strict=True):
            for name, derivatives in zip(
                driver.inputs, zip(*self.by_parameter(self.copied(law[1:3])), strict=True), strict=False
            ):
                self._add(name, derivatives)

    def block(self, block: Block) -> Iterator[tuple[str, tuple[Node, ...]]]:
        """Add a block's steps; yield the names of rows that least squares may leave open, with their gaps."""
        flat = self.copied(block.entries)
        k = len(block.unknowns)
        jacobian = tuple(tuple(flat[row * k : (row + 1) * k]) for row in range(len(block.residuals)))
        residuals = self.copied(block.residuals)
        self._solve(jacobian, residuals, block.unknowns)
        rates = [name.derivative(1) for name in block.unknowns]
        moving = [self.graph.symbol(name) for name in rates]
        rows = []
        for entries, rest in zip(jacobian, self.copied(block.velocity), strict=True):
            for entry, rate in zip(entries, moving, strict=True):
                rest = entry * rate + rest
            rows.append(rest)
        self._solve(jacobian, rows, rates)
        for name, motion in block.assigned:
            for order in (0, 1):
                (node,) = self.copied([motion[order]])
                self.steps.append(Assignment(name.derivative(order), node))
                self._add(name.derivative(order), [derivatives[0] for derivatives in self.by_parameter([node])])
        if len(residuals) > k:
            yield from zip(block.row_names, zip(*self.by_parameter(residuals), strict=True), strict=True)

    def _add(self, name: str, derivatives: Sequence[Node]) -> None:
        """Add a symbol's derivatives: a step for each that is a formula."""
        symbol = self.graph.symbol(name)
        for number, (changes, node) in enumerate(zip(self._changes, derivatives, strict=True)):
            if not node.args:  # a constant or a symbol
                changes[symbol] = node
            else:
                self.steps.append(Assignment(_derivative_name(name, number), node))
                changes[symbol] = self.graph.symbol(_derivative_name(name, number))

    def _solve(self, jacobian: tuple[tuple[Node, ...], ...], rows: Sequence[Node], unknowns: Sequence[str]) -> None:
        """Add the solution of J x = -b, with b the derivatives of rows; x are the derivatives of unknowns."""
        numbered = [
            (number, tuple(column))
            for number, column in enumerate(self.by_parameter(rows))
            if any(node.constant != 0.0 for node in column)
        ]
        if not numbered or not unknowns:
            return
        if len(unknowns) == len(rows) <= 2:
            solved = self._cramer(jacobian, [column for _, column in numbered])
            self.steps += [
                Assignment(_derivative_name(name, number), node)
                for (number, _), nodes in zip(numbered, solved, strict=True)
                for name, node in zip(unknowns, nodes, strict=True)
            ]
        else:
            names = tuple(tuple(_derivative_name(name, number) for name in unknowns) for number, _ in numbered)
            self.steps.append(LinearSolve(jacobian, tuple(column for _, column in numbered), names))
        for number, _ in numbered:
            for name in unknowns:
                self._changes[number][self.graph.symbol(name)] = self.graph.symbol(_derivative_name(name, number))

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


def _derivative_name(name: str, number: int) -> str:
    """Return the name of a symbol's derivative with respect to a parameter, by its number."""
    return f"{name}.by{number}"


def _with_steps(found: SensitivitySteps, steps: Sequence[Step]) -> SensitivitySteps:
    """Return the results with the steps that they depend on."""
    wanted = {symbol.name for symbol in symbols(found.results)}
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
    return SensitivitySteps(
        tuple(kept[::-1]),
        found.positions,
        found.rates,
        found.positions_by,
        found.rates_by,
        found.gaps,
        found.gap_names,
    )


def scale_of(plan: SolvePlan, name: str) -> float:
    """Return by how much a parameter may well change: the size for a length, else 1."""
    kinds: Mapping[str, str] = {parameter.name: parameter.quantity.kind for parameter in plan.parameters}
    return plan.size if kinds.get(name) == "length" else 1.0


__all__ = ["Assignment", "LinearSolve", "SensitivitySteps", "Step", "law_symbol", "scale_of", "sensitivity_steps"]
