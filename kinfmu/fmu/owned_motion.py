"""What an FMU needs that owns the motion of its drivers: reduced inertia, jumps of loads, and start values."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from kinfmu.codegen.python import load_model
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.loads.following import Following
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import LedLaws, effort_inputs, inertia_steps, led_laws
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.mechanics import Mechanics


class OwnedMotion(NamedTuple):
    """Motion of the drivers under efforts.

    Attributes:
        inertia: Steps to the bias efforts, then the upper triangle of the reduced inertia, row by row.
        laws: Laws over quantities with breaks, at which the integrator restarts.
        starts: Value and speed of each driver at the start.

    """

    inertia: ForceSteps
    laws: LedLaws
    starts: tuple[float, ...]


def owned_motion(plan: SolvePlan) -> tuple[SolvePlan, OwnedMotion]:
    """Return the plan with the jumps of loads in place of those of drivers, and the motion of the drivers.

    Raises:
        RequestError: The mechanism has no masses, or an effort has the name of a load's input.

    """
    mechanism = plan.mechanism
    require_masses(mechanism)
    effort_inputs(plan)
    u, ud, _ = load_model(plan).drive(mechanism.run.start, tuple(constant.value for constant in plan.law_constants))
    starts = tuple(float(x) for pair in zip(u, ud, strict=True) for x in pair)
    return replace(plan, jumps=_jumps_of_loads(plan)), OwnedMotion(inertia_steps(plan), led_laws(plan), starts)


def _jumps_of_loads(plan: SolvePlan) -> tuple[tuple[Node, Node], ...]:
    """Return the times at which laws of loads over time jump, each with its period."""
    mechanics = Mechanics(plan, coefficients="given")
    found = []
    for load in mechanics.members.loads:
        if isinstance(load, Following) and load.over is None and not isinstance(load.law, External):
            jumps = load.law.jumps(**{key: constant.value for key, constant in load.law.constants().items()})
            found += [(mechanics.graph.lift(at), mechanics.graph.lift(jumps.period)) for at in jumps.at]
    return tuple(found)
