"""Places of a plan's numbers in lists of coordinates: used by Python's loops, by C, and by C's lanes.

The lists hold the unknowns first, in the order of z, then the coordinates that are given outright, then the drivers: x
their positions, x1 their rates, x2 their accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kinfmu.codegen.kinds import UnitRun, runs_of
from kinfmu.mechanism.quantities import DistanceBetween
from kinfmu.plan import Block, SolvePlan
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.trace import is_parameter, parameter_symbol
from kinfmu.units import VariableName

LISTS = ("x", "x1", "x2")  # coordinates, their rates, their accelerations


def parametric(plan: SolvePlan) -> tuple[set[Node], list[Node]]:
    """Return the operations that depend on parameters only, and those of them that other operations or outputs use."""
    depends: dict[Node, bool] = {}  # on parameters only
    for node in plan.nodes:
        if node.op == "symbol":
            depends[node] = is_parameter(node)
        elif node.op != "constant":
            on = [arg for arg in node.args if arg.op != "constant"]
            depends[node] = bool(on) and all(depends[arg] for arg in on)
    own = {node for node, is_own in depends.items() if is_own and node.args}
    used = [arg for node in plan.nodes if node not in own for arg in node.args]
    used += [*plan.fixed_nodes.values(), *(motion.position for motion in plan.outputs_motion)]
    return own, list(dict.fromkeys(node for node in used if node in own))


class Lists:
    """The lists of a plan, and the runs of units that fill them.

    runs: its blocks as runs of units; order: names in the lists, `place` the place of each; given_outright: how many
    coordinates need no solving; parameters, derived: places of the parameters by their symbols, and of the nodes that
    depend on them alone.
    """

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.runs = runs_of(plan.blocks)
        self.kinds = {run.kind.label: run.kind for run in self.runs}
        assigned = [name for block in plan.blocks for name, _ in block.assigned]
        self.given_outright = len(assigned)
        self.order: list[VariableName] = [*plan.unknowns, *assigned, *(driver.inputs[0] for driver in plan.drivers)]
        self.place: dict[str, int] = {name: k for k, name in enumerate(self.order)}
        self.parameters: dict[str, int] = {
            parameter_symbol(parameter.name): k for k, parameter in enumerate(plan.parameters)
        }
        _, derived = parametric(plan)
        self.derived = {node: k for k, node in enumerate(derived)}

    def numbered(self) -> list[tuple[int, UnitRun]]:
        """Return the runs with their numbers, from 1."""
        return list(enumerate(self.runs, start=1))

    def places(self, order: int) -> dict[str, int]:
        """Return the place in its list of each symbol of an order."""
        return {name.derivative(order): k for k, name in enumerate(self.order)}

    def outputs(self, order: int) -> list[tuple[Node, int | None]]:
        """Return each output of an order with its place in the list, None for a formula."""
        places = self.places(order)
        nodes: list[Node] = [motion[1:][order] for motion in self.plan.outputs_motion]
        return [(node, places.get(node.name) if node.op == "symbol" else None) for node in nodes]


class DistanceRow(NamedTuple):
    """A driver of a distance, by its number, and its row in a solved block; scale: of the row, per mechanism size."""

    driver: int
    block: int
    row: int
    scale: float


def distance_rows(plan: SolvePlan, solved: Sequence[Block]) -> tuple[DistanceRow, ...]:
    """Return the rows of the plan's drivers of distances; solved: the blocks that need Newton."""
    found = []
    for number, driver in enumerate(plan.mechanism.drivers):
        measure = driver.measured()
        if isinstance(measure, DistanceBetween):
            found += [
                DistanceRow(number, k, place, measure.scale(plan.size) * plan.size)
                for k, block in enumerate(solved)
                for place, row in enumerate(block.rows)
                if (row.owner, row.label) == (driver.name, driver.noun)
            ]
    return tuple(found)
