"""What an FMU needs that owns the motion of its drivers: reduced inertia, jumps of loads, and start values."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError
from kinfmu.fmu.torque_variables import effort_names
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.loads.following import Following
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.forces import ForceSteps, effort_noun, force_steps
from kinfmu.plan.led_laws import LedLaws, led_laws
from kinfmu.plan.mechanics import Mechanics
from kinfmu.units import METRES


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
    inputs = [*effort_names(plan), *(name for load in mechanism.loads for name in load.inputs())]
    doubled = [name for name in inputs if inputs.count(name) > 1]
    if doubled:
        raise RequestError(f"'{doubled[0]}' is an input of a driver and of a load; rename one of them")
    u, ud, _ = load_model(plan).drive(mechanism.run.start, tuple(constant.value for constant in plan.law_constants))
    starts = tuple(float(x) for pair in zip(u, ud, strict=True) for x in pair)
    return replace(plan, jumps=_jumps_of_loads(plan)), OwnedMotion(_inertia(plan), led_laws(plan), starts)


def _inertia(plan: SolvePlan) -> ForceSteps:
    drivers = plan.drivers
    wanted = [f"{driver.name}.bias_{effort_noun(driver.quantity.kind)}" for driver in drivers]
    for k, driver in enumerate(drivers):
        wanted.append(f"{driver.name}.reduced_inertia")
        wanted += [f"{driver.name}.reduced_inertia.{other.name}" for other in drivers[k + 1 :]]
    steps = force_steps(plan, wanted, coefficients="given")
    results = {str(name): (name, node) for name, node in zip(steps.names, steps.results, strict=True)}
    names, nodes = zip(*(results[name] for name in wanted), strict=True)
    return ForceSteps(steps.steps, names, list(nodes))


def _jumps_of_loads(plan: SolvePlan) -> tuple[tuple[Node, Node], ...]:
    """Return the times at which laws of loads over time jump, each with its period."""
    mechanics = Mechanics(plan, coefficients="given")
    found = []
    for load in mechanics.members.loads:
        if isinstance(load, Following) and load.over is None and not isinstance(load.law, External):
            jumps = load.law.jumps(**{key: constant.value for key, constant in load.law.constants().items()})
            found += [(mechanics.graph.lift(at), mechanics.graph.lift(jumps.period)) for at in jumps.at]
    return tuple(found)


def units_in_si(plan: SolvePlan) -> tuple[float, ...]:
    """Return the units of the drivers in SI units."""
    metre = METRES[plan.mechanism.length_unit]
    return tuple(metre if driver.quantity.kind == "length" else 1.0 for driver in plan.drivers)
