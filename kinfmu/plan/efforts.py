"""What the motion of the drivers under efforts needs of a plan.

Names and units of efforts; the steps to the reduced inertia; arguments and breaks of laws over quantities of the pose,
where integrators restart.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from kinfmu.errors import RequestError
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.laws.law import TURN, Jumps
from kinfmu.mechanism.loads.load import Following
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.forces import ForceSteps, effort_noun, force_steps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Assignment, Step, law_symbol, needed_steps
from kinfmu.plan.trace import parameter_symbol
from kinfmu.units import METRES, ForceName, Quantity

# Derivatives of a law up to these count: where they jump, the accelerations of the drivers have at least a kink.
OF_JOINTS, OF_LOADS = 3, 2


def load_inputs(plan: SolvePlan) -> tuple[str, ...]:
    """Return the names of the inputs that give efforts of external loads."""
    return tuple(name for load in plan.mechanism.loads for name in load.inputs())


def effort_names(plan: SolvePlan) -> list[str]:
    """Return the names of the inputs for the efforts of the drivers, such as 'crank_torque'."""
    return [f"{driver.name}_{effort_noun(driver.quantity.kind)}" for driver in plan.drivers]


def effort_inputs(plan: SolvePlan) -> list[str]:
    """Return the names of the inputs for all efforts: of the drivers, then of loads.

    Raise a RequestError if an effort of a driver has the name of a load's input.
    """
    names = [*effort_names(plan), *load_inputs(plan)]
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise RequestError(f"'{doubled[0]}' is an input of a driver and of a load; rename one of them")
    return names


def inertia_steps(plan: SolvePlan) -> ForceSteps:
    """Return the steps to the bias efforts, then to the upper triangle of the reduced inertia, row by row."""
    drivers = plan.drivers
    order = [f"{driver.name}.bias_{effort_noun(driver.quantity.kind)}" for driver in drivers]
    for k, driver in enumerate(drivers):
        order.append(f"{driver.name}.reduced_inertia")
        order += [f"{driver.name}.reduced_inertia.{other.name}" for other in drivers[k + 1 :]]
    steps = force_steps(plan, order, coefficients="given")
    results = {str(name): (name, node) for name, node in zip(steps.names, steps.results, strict=True)}
    names, nodes = zip(*(results[name] for name in order), strict=True)
    return ForceSteps(steps.steps, names, list(nodes))


def units_in_si(plan: SolvePlan) -> tuple[float, ...]:
    """Return the units of the drivers in SI units."""
    metre = METRES[plan.mechanism.length_unit]
    return tuple(metre if driver.quantity.kind == "length" else 1.0 for driver in plan.drivers)


class LedLaws(NamedTuple):
    """The laws of joints and loads that have breaks.

    Attributes:
        steps: To numbers of each law: its argument g, the turn after which g jumps back (0: it does not), the unit of g
            (1 rad or the size), the period of the breaks (0: none), and the breaks.
        counts: How many breaks each law has.

    """

    steps: ForceSteps
    counts: tuple[int, ...]


def led_laws(plan: SolvePlan) -> LedLaws:
    """Return the laws of joints and loads whose arguments and breaks follow from the unknowns of a plan."""
    mechanics = Mechanics(plan, coefficients="given")
    graph = mechanics.graph
    known = {name.derivative(0) for name in plan.unknowns} | {driver.inputs[0] for driver in plan.drivers}
    known |= {parameter_symbol(parameter.name) for parameter in plan.parameters}
    known |= {law_symbol(constant.name) for constant in plan.load_constants}
    nodes: list[Node] = []
    names: list[ForceName] = []
    counts = []
    for name, kind, argument, jumps in _laws(mechanics):
        is_angle, wraps = kind == "angle", graph.lift(argument).op == "atan2"
        head = (argument, TURN if wraps else 0.0, 1.0 if is_angle else plan.size, jumps.period)
        own = [graph.lift(value) for value in (*head, *jumps.at)]
        if jumps.at and _given(own, mechanics.steps) <= known:
            nodes += own
            names += [ForceName(name, f"law_{k}", Quantity("number")) for k in range(len(own))]
            counts.append(len(jumps.at))
    return LedLaws(ForceSteps(needed_steps(nodes, mechanics.steps), tuple(names), nodes), tuple(counts))


def _laws(mechanics: Mechanics) -> Iterator[tuple[str, str, Value, Jumps]]:
    """Yield the name, the kind of the argument, the argument and the breaks of each law over a quantity."""
    members = mechanics.members
    for joint in members.joints:
        at = Placement({body: mechanics.pose(body) for body in joint.bodies()}, members.body_points)
        led = joint.led_by(at)
        if led is not None:
            law, argument = led
            kind = getattr(joint, "law_kinds", ("", "length"))[1]
            yield joint.name, kind, argument, _breaks(law, OF_JOINTS)
    for load in members.loads:
        argument = load.argument(mechanics.placement(load))
        if isinstance(load, Following) and argument is not None:
            yield load.name, load.law_kinds[1], argument, _breaks(load.law, OF_LOADS)


def _breaks(law: Law, order: int) -> Jumps:
    return law.breaks(order, **{key: constant.value for key, constant in law.constants().items()})


def _given(nodes: list[Node], steps: list[Step]) -> set[str]:
    """Return the names of the symbols that nodes need and no step gives."""
    needed = [step for step in needed_steps(nodes, steps) if isinstance(step, Assignment)]
    roots = [*nodes, *(step.node for step in needed)]
    return {symbol.name for symbol in symbols(roots)} - {step.name for step in needed}
