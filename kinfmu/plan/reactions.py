"""Reactions of joints: the multipliers of their rows, block after block in reverse order.

    Phi_q^T lambda = Q - M qdd        Q: generalized forces of gravity and loads

A row that gives a coordinate outright has its multiplier from the equation of that coordinate; a block has those of its
rows from the transposed Jacobian. The effort along a row, per unit of its gap, is what the joint transmits: the force
or moment that its first body exerts on its second. Haug (1989), Lagrange multipliers and reaction forces.
"""

from __future__ import annotations

from collections.abc import Container

from kinfmu.mechanism.force_names import names_of_rows, reaction_names_of
from kinfmu.plan.block import Block
from kinfmu.plan.contacts import carried
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.equations.system import System
from kinfmu.plan.forces import ForceSteps, chosen_steps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.origin import localized
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.shaking import shaking_nodes
from kinfmu.plan.steps import Assignment
from kinfmu.plan.structure import RowTracer
from kinfmu.units import CoordinateName

__all__ = [
    "names_of_rows",
    "reaction_names_of",
    "reaction_steps",
]


def reaction_steps(plan: SolvePlan, wanted: Container[str] | None = None) -> ForceSteps:
    """Return the steps to the reactions of all joints and on the ground, in the order of `reaction_names_of`.

    Where redundant rows share a load, the steps give one of the possible distributions. What the unknown contact of a
    cam loads lacks its force.

    Args:
        plan: The plan, as `Mechanics` takes it.
        wanted: Names of those of joints that are wanted, without those on the ground. Default: all.

    """
    mechanics = Mechanics(plan)
    multipliers = _Multipliers(plan, mechanics).of_row
    zero = mechanics.graph.constant(0.0)
    efforts: dict[int, list[Node]] = {}
    row = 0
    for number, joint in enumerate(mechanics.tracer.joints):
        efforts[number] = []
        for kind, scale in zip(joint.kinds(), joint.scales(), strict=True):
            effort = -(multipliers.get(row, zero) * scale)
            efforts[number].append(effort / mechanics.metre if kind == "length" else effort)
            row += 1
    for (number, row), amount in carried(mechanics, efforts).items():
        efforts[number][row] = efforts[number][row] + amount
    results = [effort for own in efforts.values() for effort in own]
    names = reaction_names_of(plan.mechanism)
    if wanted is None:
        results += shaking_nodes(plan, mechanics)
    return chosen_steps(names[: len(results)], results, mechanics.steps, wanted)


class _Multipliers:
    """The multipliers of all rows, as steps on a graph.

    Attributes:
        of_row: The multiplier of each row, by its index; rows that nothing loads have none.

    """

    def __init__(self, plan: SolvePlan, mechanics: Mechanics) -> None:
        self.of_row: dict[int, Node] = {}
        self._mechanics = mechanics
        self._graph = mechanics.graph
        self._system = System(localized(plan.mechanism)[0])
        self._row = RowTracer(self._system, mechanics.tracer)
        self._index = {row.name: index for index, row in enumerate(self._system.rows)}
        self._open = mechanics.unbalanced(mechanics.members.loads)
        mechanics.steps += [Assignment(name, node) for name, node in mechanics.known.items()]
        for block in reversed(plan.blocks):
            self._block(block)
        for name, row in reversed(list(plan.known_by.items())):
            self._outright(name, self._index[row])

    def _block(self, block: Block) -> None:
        """Balance the coordinates of a block by its rows."""
        if block.unknowns:
            self._solve(block)
        for (name, _), row in zip(reversed(block.assigned), reversed(block.assigned_by), strict=True):
            self._outright(name, self._index[row.name])

    def _solve(self, block: Block) -> None:
        """Add the multipliers of a block's rows, J^T lambda = -w; w: the open forces along its unknowns."""
        graph, one = self._graph, self._graph.constant(1.0)
        assigned = self._mechanics.copied([motion[0] for _, motion in block.assigned])
        forces = []
        for unknown in block.unknowns:
            along = self._open_along(unknown)
            slopes = graph.derivative(assigned, {graph.symbol(unknown): one})
            for (name, _), slope in zip(block.assigned, slopes, strict=True):
                along = along + self._open_along(name) * slope
            forces.append(along)
        if all(force.constant == 0.0 for force in forces):
            return
        jacobian = self._mechanics.jacobian(block)
        transposed = tuple(zip(*jacobian, strict=True))
        names = tuple(f"{row.name}.multiplier" for row in block.rows)
        solved = self._mechanics.solutions(transposed, [tuple(forces)], [names])[0]
        is_relative = len(block.rows) > len(block.unknowns)  # least squares weigh rows relative to the size
        for row, multiplier in zip(block.rows, solved, strict=True):
            scale = row.scale * self._system.size if is_relative else 1.0
            self._add(self._index[row.name], multiplier / scale)

    def _outright(self, name: CoordinateName, index: int) -> None:
        """Balance a coordinate by the row that gives it."""
        force = self._open_along(name)
        if force.constant != 0.0:
            self._add(index, -(force / self._slope(index, name)))

    def _add(self, index: int, multiplier: Node) -> None:
        """Add the multiplier of a row, and what it exerts along the coordinates of its bodies."""
        if multiplier.args:
            name = f"{self._system.rows[index].name}.lambda"
            self._mechanics.steps.append(Assignment(name, multiplier))
            multiplier = self._graph.symbol(name)
        self.of_row[index] = multiplier
        for column in self._system.members[self._system.member_of[index]].columns:
            coordinate = self._system.coordinates[column]
            self._open[coordinate] = self._open_along(coordinate) + self._slope(index, coordinate) * multiplier

    def _open_along(self, name: str) -> Node:
        return self._open.get(name, self._graph.constant(0.0))

    def _slope(self, index: int, name: str) -> Node:
        """Return the derivative of a row with respect to a coordinate, the others where they are."""
        known = {other: node for other, node in self._mechanics.known.items() if other != name}
        row = self._row(index, known)
        return self._graph.derivative([row], {self._graph.symbol(name): self._graph.constant(1.0)})[0]
