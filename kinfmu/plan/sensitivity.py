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

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from kinfmu.mechanism.parameters import parameter_values
from kinfmu.plan.equations.graph import Graph, Node
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Step, Tracing, law_symbol, needed_steps
from kinfmu.plan.trace import parameter_symbol


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
