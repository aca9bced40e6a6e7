"""Loads along the line between two points: where these are in the same place, the load has no direction."""

from __future__ import annotations

from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import needed_steps
from kinfmu.units import ForceName, Quantity


def distance_steps(plan: SolvePlan) -> ForceSteps:
    """Return the steps to the distances [m] between the ends of loads that need a direction; 0: they have none.

    Args:
        plan: The plan, as `Mechanics` takes it.

    """
    mechanics = Mechanics(plan, coefficients="given")
    loads = [load for load in mechanics.members.loads if load.needs_direction]
    nodes = [node for load in loads for node in mechanics.measured(load)]
    names = tuple(ForceName(load.name, "distance", Quantity("length")) for load in loads)
    return ForceSteps(needed_steps(nodes, mechanics.steps), names, nodes)


def meeting_messages(plan: SolvePlan, steps: ForceSteps) -> tuple[str, ...]:
    """Return what is reported where the distance is 0, for each load of `distance_steps`."""
    types = {load.name: load.type.replace("_", " ") for load in plan.mechanism.loads}
    return tuple(
        f"forces have no value: the ends of {types[name.owner]} '{name.owner}' are in the same place, "
        f"so that it has no direction"
        for name in steps.names
    )
