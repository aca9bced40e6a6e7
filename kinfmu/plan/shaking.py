"""Shaking force and moment: what the mechanism and its drives exert on the ground, from momentum alone.

    F = sum m (g - a) + sum f,   M = sum r_c x m (g - a) - sum I alpha + sum (r x f)

Sums go over the moving bodies and the loads f that act on them from outside; r is seen from the origin of the ground.
What acts between bodies, or between a body and the ground, is no load from outside: the ground takes its other end.
Berkof and Lowen (1969) define both by the inertia forces alone; here with weights and loads.
"""

from __future__ import annotations

from collections.abc import Container

from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.force_names import shaking_names
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.forces import ForceSteps, chosen_steps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Assignment


def shaking_steps(plan: SolvePlan, wanted: Container[str] | None = None) -> ForceSteps:
    """Return the steps to shaking force and moment alone; they solve nothing.

    Args:
        plan: The plan, as `Mechanics` takes it.
        wanted: Names of those that are wanted. Default: all.

    """
    mechanics = Mechanics(plan, coefficients="given")
    nodes = shaking_nodes(plan, mechanics)  # of loads too, whose slopes are along symbols of known coordinates
    mechanics.steps += [Assignment(name, node) for name, node in mechanics.known.items()]
    return chosen_steps(shaking_names(plan.mechanism), nodes, mechanics.steps, wanted)


def shaking_nodes(plan: SolvePlan, mechanics: Mechanics) -> list[Node]:
    """Return force (x, y) [N] and moment [N m] on the ground."""
    graph, metre = mechanics.graph, mechanics.metre
    outside = [load for load in mechanics.members.loads if len(set(load.acts_on())) == 1]
    needed = mechanics.unbalanced(outside)
    f_x = f_y = moment = graph.constant(0.0)
    for body in mechanics.members.bodies:
        if body.name == GROUND_NAME:
            continue
        x, y, turning = (needed[f"{body.name}.{axis}"] for axis in ("x", "y", "phi"))
        pose = mechanics.pose(body.name)
        f_x, f_y = f_x - x / metre, f_y - y / metre
        moment = moment - turning - (pose.x + plan.origin[0]) * y + (pose.y + plan.origin[1]) * x
    return [f_x, f_y, moment]
