"""Masses and loads of a plan on a graph: motion of the centres of mass, quantities along which loads act.

All is in SI units, whatever the mechanism's unit of length is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

from kinfmu.mechanism.body import GROUND_NAME, Body
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement
from kinfmu.mechanism.settings import with_law_constants
from kinfmu.plan.block import TimeDerivatives
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.origin import localized
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Tracing, derivative_name, law_symbol
from kinfmu.plan.trace import Tracer
from kinfmu.units import METRES

Coefficients = Literal["solved", "given", "rates"]
"""Velocity coefficients: solved block after block; given symbols; or rates over the speed of the only driver."""


class Center(NamedTuple):
    """The centre of mass of a body.

    Attributes:
        body: The body, its numbers as nodes.
        arm: From the body's origin, in world axes [m].
        origin: The body's origin, seen from the plan's origin [m].
        position: Origin and arm [m].
        acceleration: Relative to free fall [m/s2].
        phi: Angle of the body [rad].
        alpha: Angular acceleration of the body [rad/s2].

    """

    body: Body
    arm: tuple[Node, Node]
    origin: tuple[Node, Node]
    position: tuple[Node, Node]
    acceleration: tuple[Node, Node]
    phi: Node
    alpha: Node

    def turned(self, rates: Sequence[Node]) -> tuple[Node, Node]:
        """Return a rate (x, y) of the position from the rates (x, y, phi) of origin and angle."""
        (x, y, phi), (arm_x, arm_y) = rates, self.arm
        return x - phi * arm_y, y + phi * arm_x


class Mechanics(Tracing):
    """The coordinates of a plan as nodes of a new graph; masses and loads on it.

    The steps give the coordinates that rows give outright, with their rates and accelerations.

    Args:
        plan: The plan. It must solve the bodies that have masses and those on which loads act.
        coefficients: How derivatives of unknowns with respect to drivers are found.

    """

    def __init__(self, plan: SolvePlan, *, coefficients: Coefficients = "solved") -> None:
        self.tracer = Tracer(localized(plan.mechanism)[0], [parameter.name for parameter in plan.parameters])
        graph, one = self.tracer.graph, self.tracer.graph.constant(1.0)
        changes = [{graph.symbol(driver.inputs[0]): one} for driver in plan.drivers]
        super().__init__(graph, changes, frozenset(constant.name for constant in plan.law_constants))
        members, settable = self.tracer.members, plan.load_constants
        loads = with_law_constants(
            members.loads, settable, {one.name: graph.symbol(law_symbol(one.name)) for one in settable}
        )
        self.members = replace(members, loads=loads)
        self.metre = METRES[plan.mechanism.length_unit]
        self.known = dict(zip(plan.known, self.copied(list(plan.known.values())), strict=True))
        self.rates = TimeDerivatives(self.tracer, self.known)
        self._per_driver = [1.0 if driver.quantity.kind == "angle" else 1.0 / self.metre for driver in plan.drivers]
        for block in plan.blocks:
            if coefficients == "solved":
                self.positions(block)
                continue
            for name in block.unknowns:
                for number, (change, driver) in enumerate(zip(self.changes, plan.drivers, strict=True)):
                    if coefficients == "rates":
                        slope = graph.symbol(name.derivative(1)) * (one / graph.symbol(driver.inputs[1]))
                    else:
                        slope = graph.symbol(derivative_name(name, number))
                    change[graph.symbol(name)] = slope
            self.assigned(block)

    def pose(self, body: str, free: str = "") -> BodyFrame:
        """Return the frame of a body, seen from the plan's origin [length]; free: a coordinate that stays a symbol."""
        if body == GROUND_NAME:
            return GROUND
        names = (f"{body}.{axis}" for axis in ("x", "y", "phi"))
        symbols = self.tracer.symbols
        return BodyFrame.of(*(symbols[name] if name == free else self.known.get(name, symbols[name]) for name in names))

    def in_si(self, kind: str, node: Node) -> Node:
        """Return a length in metres; an angle as it is."""
        return node * self.metre if kind == "length" else node

    def coefficients(self, node: Node) -> tuple[Node, ...]:
        """Return the derivatives of a quantity with respect to the drivers, all in SI units."""
        return tuple(
            derivatives[0] * per for derivatives, per in zip(self.by_direction([node]), self._per_driver, strict=True)
        )

    def gravity(self) -> tuple[Node, Node]:
        """Return the acceleration of gravity [m/s2]."""
        x, y = (self.graph.lift(g) * self.metre for g in self.members.gravity or (0.0, 0.0))
        return x, y

    def centers(self) -> Iterator[Center]:
        """Yield the centres of mass of the moving bodies.

        a = a_origin + alpha x arm - omega^2 arm - g        less work than two derivatives of the position
        """
        graph = self.graph
        for body in self.members.bodies:
            if body.is_ground:
                continue
            pose, (s_x, s_y) = self.pose(body.name), body.center_of_mass
            arm_x = graph.lift(pose.c * s_x - pose.s * s_y) * self.metre
            arm_y = graph.lift(pose.s * s_x + pose.c * s_y) * self.metre
            x, y, phi = graph.lift(pose.x) * self.metre, graph.lift(pose.y) * self.metre, graph.lift(pose.phi)
            (omega,), (a_x, a_y, alpha) = self.rates.of([phi]), self.rates.second([x, y, phi])
            square, (g_x, g_y) = omega * omega, self.gravity()
            acceleration = (
                a_x - (alpha * arm_y + square * arm_x) - g_x,
                a_y + (alpha * arm_x - square * arm_y) - g_y,
            )
            yield Center(body, (arm_x, arm_y), (x, y), (x + arm_x, y + arm_y), acceleration, phi, alpha)

    def placement(self, load: Load, free: str = "") -> Placement:
        """Return the poses of the bodies of a load; free: a coordinate that stays a symbol."""
        return Placement({name: self.pose(name, free) for name in load.bodies()}, self.members.body_points)

    def measured(self, load: Load, free: str = "") -> list[Node]:
        """Return the quantities along which a load acts [m, rad]."""
        quantities = load.measured(self.placement(load, free))
        return [self.in_si(kind, self.graph.lift(node)) for kind, node in zip(load.kinds(), quantities, strict=True)]

    def efforts(self, load: Load) -> list[Node]:
        """Return the efforts of a load along its quantities [N, N m]."""
        at, measured, inputs = self.placement(load), self.measured(load), load.inputs()
        over = load.argument(at)
        argument = self.graph.symbol(inputs[0] if inputs else "time") if over is None else over
        return [self.graph.lift(one) for one in load.efforts(at, measured, self.rates.of(measured), argument)]

    def unbalanced(self, loads: Sequence[Load]) -> dict[str, Node]:
        """Return what the motion needs besides gravity and some loads, by coordinate [J per unit of the coordinate].

        M qdd - Q        Q: generalized forces of gravity and the loads
        """
        graph, metre = self.graph, self.metre
        found: dict[str, Node] = {}
        for center in self.centers():
            mass, inertia = graph.lift(center.body.mass), graph.lift(center.body.inertia)
            f_x, f_y = (mass * acceleration for acceleration in center.acceleration)
            name = center.body.name
            found[f"{name}.x"], found[f"{name}.y"] = f_x * metre, f_y * metre
            found[f"{name}.phi"] = f_y * center.arm[0] - f_x * center.arm[1] + inertia * center.alpha
        one = graph.constant(1.0)
        for load in loads:
            efforts = self.efforts(load)
            for body in load.acts_on():
                for axis in () if body == GROUND_NAME else ("x", "y", "phi"):
                    name = f"{body}.{axis}"
                    slopes = graph.derivative(self.measured(load, free=name), {graph.symbol(name): one})
                    for effort, slope in zip(efforts, slopes, strict=True):
                        found[name] = found[name] - effort * slope
        return found
