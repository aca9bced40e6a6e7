"""Quantities that measures read, by name or made of coordinates, and models that compute them and nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.members import COORDINATES
from kinfmu.mechanism.quantities import CoordinateOf, PoseQuantity
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.plan import MotionNodes
from kinfmu.plan.trace import is_parameter, parameter_symbol
from kinfmu.run.model import Model
from kinfmu.units import CoordinateName, ForceName

QuantityRead = CoordinateName | PoseQuantity  # a column of a run, or made of the coordinates of bodies
_MOST_KEPT = 8  # of each model
_kept: WeakKeyDictionary[Model, dict[tuple[QuantityRead, ...], Model]] = WeakKeyDictionary()


class QuantityNames:
    """Names of the quantities of a mechanism."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism

    @cached_property
    def orders(self) -> dict[str, tuple[CoordinateName, int]]:
        """Each coordinate and its rates, with the coordinate and the order."""
        return coordinate_orders(self._mechanism.coordinate_names, self._mechanism.points)

    @cached_property
    def forces(self) -> dict[str, tuple[ForceName, ...]]:
        """Forces that are measured, by name."""
        return {name: made for name, made in measured_forces(self._mechanism).items() if name not in self.orders}

    def quantities(self, *readings: Reading) -> tuple[QuantityRead, ...]:
        """Return the quantities with rates that measures read, each once; of points both coordinates."""
        read: list[QuantityRead] = []
        for of in (of for reading in readings for of in reading.quantities()):
            if isinstance(of, PoseQuantity):
                read.append(of)
            elif of in self.orders:
                read.append(self.orders[of][0])
            elif of in self._mechanism.body_points:
                read += path_of(of)
        return tuple(dict.fromkeys(read))


def path_of(point: str) -> tuple[CoordinateOf, CoordinateOf]:
    """Return the world coordinates of a point 'body.point'."""
    return CoordinateOf(point, "x"), CoordinateOf(point, "y")


def coordinates_behind(quantities: Iterable[QuantityRead]) -> tuple[CoordinateName, ...]:
    """Return the coordinates of bodies and points of interest of which quantities are made, each once."""
    names: list[CoordinateName] = []
    for quantity in quantities:
        if isinstance(quantity, CoordinateName):
            names.append(quantity)
        else:
            moving = [body for body in quantity.bodies() if body != GROUND_NAME]
            names += [CoordinateName(body, axis) for body in moving for axis in COORDINATES]
    return tuple(dict.fromkeys(names))


def quantity_model(model: Model, quantities: Sequence[QuantityRead]) -> Model:
    """Return a model whose outputs are quantities, in this order.

    It solves the same blocks, so that a design which the model cannot assemble has no numbers here either.

    model: The model, of whose outputs and fixed coordinates the quantities are made.
    """
    kept = _kept.setdefault(model, {})
    key = tuple(quantities)
    if key not in kept:
        if len(kept) >= _MOST_KEPT:
            kept.pop(next(iter(kept)))
        names = (CoordinateName(f"quantity_{k}", "phi" if one.is_angle else "x") for k, one in enumerate(quantities))
        nodes = quantity_nodes(model.plan, quantities)
        motions = [_motion(model.plan, name, node) for name, node in zip(names, nodes, strict=True)]
        kept[key] = Model(replace(model.plan, outputs_motion=tuple(motions), coordinate_count=0), model.engine)
    return kept[key]


def quantity_nodes(plan: SolvePlan, quantities: Sequence[QuantityRead]) -> list[Node]:
    """Return the quantities as nodes of the plan's graph."""
    graph = plan.laws[0].position.graph
    nodes: dict[str, Node] = {name: node for name, node in plan.fixed_nodes.items()}  # noqa: C416  of other keys
    nodes |= {motion.name: motion.position for motion in plan.outputs_motion}
    open_ones = {parameter.name: graph.symbol(parameter_symbol(parameter.name)) for parameter in plan.parameters}
    points: Any = plan.mechanism.at(open_ones).body_points

    def placement(bodies: Sequence[str]) -> Placement:
        poses = {
            body: GROUND if body == GROUND_NAME else BodyFrame.of(*(nodes[f"{body}.{axis}"] for axis in COORDINATES))
            for body in bodies
        }
        return Placement(poses, points)

    return [
        graph.lift(nodes[one] if isinstance(one, CoordinateName) else one.value(placement(one.bodies())))
        for one in quantities
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
