"""Arguments and breaks of the laws of joints, as a list of steps: where integrators of the motion restart."""

from __future__ import annotations

from typing import NamedTuple

from kinfmu.equations.graph import Node, symbols
from kinfmu.laws.law import TURN
from kinfmu.measures.placement import Placement
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Assignment, Step, needed_steps
from kinfmu.plan.trace import parameter_symbol
from kinfmu.units import ForceName, Quantity

ORDER = 3  # derivatives of a law up to this one count: where the third one jumps, the acceleration has a kink


class LedLaws(NamedTuple):
    """The laws of joints that have breaks.

    Attributes:
        steps: To numbers of each law: its argument g, the turn after which g jumps back (0: it does not), the unit of g
            (1 rad or the size), the period of the breaks (0: none), and the breaks.
        counts: How many breaks each law has.

    """

    steps: ForceSteps
    counts: tuple[int, ...]


def led_laws(plan: SolvePlan) -> LedLaws:
    """Return the laws of the joints whose arguments follow from the unknowns of a plan."""
    mechanics = Mechanics(plan, coefficients="given")
    graph, members = mechanics.graph, mechanics.members
    known = {name.derivative(0) for name in plan.unknowns} | {driver.inputs[0] for driver in plan.drivers}
    known |= {parameter_symbol(parameter.name) for parameter in plan.parameters}
    nodes: list[Node] = []
    names: list[ForceName] = []
    counts = []
    for joint in members.joints:
        at = Placement({body: mechanics.pose(body) for body in joint.bodies()}, members.body_points)
        led = joint.led_by(at)
        if led is None:
            continue
        law, argument = led
        jumps = law.breaks(ORDER, **{key: constant.value for key, constant in law.constants().items()})
        is_angle, wraps = getattr(joint, "law_kinds", ("", ""))[1] == "angle", graph.lift(argument).op == "atan2"
        head = (argument, TURN if wraps else 0.0, 1.0 if is_angle else plan.size, jumps.period)
        own = [graph.lift(value) for value in (*head, *jumps.at)]
        if not jumps.at or not _given(own, mechanics.steps) <= known:
            continue
        nodes += own
        names += [ForceName(joint.name, f"law_{k}", Quantity("number")) for k in range(len(own))]
        counts.append(len(jumps.at))
    return LedLaws(ForceSteps(needed_steps(nodes, mechanics.steps), tuple(names), nodes), tuple(counts))


def _given(nodes: list[Node], steps: list[Step]) -> set[str]:
    """Return the names of the symbols that nodes need and no step gives."""
    needed = [step for step in needed_steps(nodes, steps) if isinstance(step, Assignment)]
    roots = [*nodes, *(step.node for step in needed)]
    return {symbol.name for symbol in symbols(roots)} - {step.name for step in needed}
