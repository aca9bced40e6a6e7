"""Models whose outputs are the quantities that measures read, so that generated code computes them and nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.members import COORDINATES
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement
from kinfmu.motion.needed import QuantityRead, is_angle, value_of
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.plan import MotionNodes
from kinfmu.plan.trace import is_parameter, parameter_symbol
from kinfmu.run.model import Model
from kinfmu.units import CoordinateName

_MOST_KEPT = 8  # of each model
_kept: WeakKeyDictionary[Model, dict[tuple[QuantityRead, ...], Model]] = WeakKeyDictionary()


def quantity_model(
    model: Model, quantities: Sequence[QuantityRead]
) -> tuple[Model, dict[QuantityRead, CoordinateName]]:
    """Return a model whose outputs are quantities, and the names of the outputs.

    It solves the same blocks, so that a design which the model cannot assemble has no numbers here either.

    Args:
        model: The model, of whose outputs and fixed coordinates the quantities are made.
        quantities: The quantities.

    """
    names = {one: CoordinateName(f"quantity_{k}", "phi" if is_angle(one) else "x") for k, one in enumerate(quantities)}
    kept = _kept.setdefault(model, {})
    key = tuple(quantities)
    if key not in kept:
        if len(kept) >= _MOST_KEPT:
            kept.pop(next(iter(kept)))
        nodes = _nodes(model.plan, quantities)
        motions = [_motion(model.plan, names[one], node) for one, node in zip(quantities, nodes, strict=True)]
        kept[key] = Model(replace(model.plan, outputs_motion=tuple(motions), coordinate_count=0), model.engine)
    return kept[key], names


def _nodes(plan: SolvePlan, quantities: Sequence[QuantityRead]) -> list[Node]:
    """Return the quantities as nodes of the plan's graph."""
    graph = plan.laws[0].position.graph
    known: dict[str, Node] = {name: node for name, node in plan.fixed_nodes.items()}  # noqa: C416  of other keys
    known |= {motion.name: motion.position for motion in plan.outputs_motion}
    open_ones = {parameter.name: graph.symbol(parameter_symbol(parameter.name)) for parameter in plan.parameters}
    points: Any = plan.mechanism.at(open_ones).body_points

    def placement(bodies: Sequence[str]) -> Placement:
        poses = {
            body: GROUND if body == GROUND_NAME else BodyFrame.of(*(known[f"{body}.{axis}"] for axis in COORDINATES))
            for body in bodies
        }
        return Placement(poses, points)

    return [
        graph.lift(known[one] if isinstance(one, CoordinateName) else value_of(one, placement)) for one in quantities
    ]


def _motion(plan: SolvePlan, name: CoordinateName, position: Node) -> MotionNodes[CoordinateName]:
    """Return a quantity with its rate and acceleration; those of coordinates and of drivers are symbols."""
    graph = position.graph
    derivatives: Mapping[str, tuple[str, ...]] = {
        **{one: (one, one.derivative(1), one.derivative(2)) for one in plan.mechanism.coordinate_names},
        **{driver.inputs[0]: driver.inputs for driver in plan.drivers},
    }
    first: dict[Node, Node] = {}
    both: dict[Node, Node] = {}
    for symbol in symbols([position]):
        if not is_parameter(symbol):
            value, rate, acceleration = map(graph.symbol, derivatives[symbol.name])
            first[value] = both[value] = rate
            both[rate] = acceleration
    (rate,) = graph.derivative([position], first)
    (acceleration,) = graph.derivative([rate], both)
    return MotionNodes(name, position, rate, acceleration)
