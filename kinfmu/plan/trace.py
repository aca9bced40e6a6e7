"""Tracing the joints' formulas, with some coordinates known as constants or as expressions of others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement, body_of
from kinfmu.plan.equations.graph import Graph, Node


class ParameterSymbol(str):
    """The name of a parameter's symbol: with a full stop at its end it differs from every coordinate and input."""

    __slots__ = ()


def parameter_symbol(name: str) -> ParameterSymbol:
    """Return the name of a parameter's symbol."""
    return ParameterSymbol(f"{name}.")


def is_parameter(symbol: Node) -> bool:
    """Return True for the symbol of a parameter."""
    return isinstance(symbol.value, ParameterSymbol)


class Tracer:
    """Joints, drivers and points as nodes of one graph.

    Coordinates, driver values and settable parameters are symbols of the graph; other parameters are numbers, or are
    computed from the settable ones.

    Args:
        mechanism: The mechanism.
        parameters: Names of the settable parameters. Default: all that are given as numbers.

    """

    def __init__(self, mechanism: Mechanism, parameters: Iterable[str] | None = None) -> None:
        self.mechanism = mechanism
        self.graph = Graph()
        self.symbols: dict[str, Node] = {name: self.graph.symbol(name) for name in mechanism.coordinate_names}
        self.targets = {driver.name: self.graph.symbol(driver.inputs()[0]) for driver in mechanism.drivers}
        settable = mechanism.own_parameters if parameters is None else parameters
        self.members = members = mechanism.at({name: self.graph.symbol(parameter_symbol(name)) for name in settable})
        self.joints = members.joints
        self.drivers = members.drivers
        self._points = members.body_points

    def joint(self, joint: Joint, known: Mapping[str, Node]) -> tuple[Node, ...]:
        """Return the rows of a joint, with `known` in place of the symbols of some coordinates."""
        return tuple(self.graph.lift(row) for row in joint.residual(self.placement(joint.bodies(), known)))

    def driver(self, driver: Driver, known: Mapping[str, Node]) -> Node:
        """Return the row of a driver, with `known` in place of the symbols of some coordinates."""
        placement = self.placement(driver.bodies(), known)
        return self.graph.lift(driver.residual(placement, self.targets[driver.name]))

    def point(self, name: str, known: Mapping[str, Node]) -> tuple[Node, Node]:
        """Return the world coordinates of a point 'body.point'."""
        x, y = self.placement((body_of(name),), known).point(name)
        return self.graph.lift(x), self.graph.lift(y)

    def placement(self, bodies: tuple[str, ...], known: Mapping[str, Node]) -> Placement:
        """Return the poses of bodies, with `known` in place of the symbols of some coordinates."""
        poses = {}
        for body in bodies:
            if body == GROUND_NAME:
                poses[body] = GROUND
            else:
                names = (f"{body}.{axis}" for axis in ("x", "y", "phi"))
                poses[body] = BodyFrame.of(*(known.get(name, self.symbols[name]) for name in names))
        return Placement(poses, self._points)
