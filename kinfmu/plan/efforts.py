"""Motion of the drivers under efforts, as far as a plan gives it: inputs, units, bias efforts and reduced inertia."""

from __future__ import annotations

from kinfmu.errors import RequestError
from kinfmu.plan.forces import ForceSteps, effort_noun, force_steps
from kinfmu.plan.plan import SolvePlan
from kinfmu.units import METRES


def load_inputs(plan: SolvePlan) -> tuple[str, ...]:
    """Return the names of the inputs that give efforts of external loads."""
    return tuple(name for load in plan.mechanism.loads for name in load.inputs())


def effort_names(plan: SolvePlan) -> list[str]:
    """Return the names of the inputs for the efforts of the drivers, such as 'crank_torque'."""
    return [f"{driver.name}_{effort_noun(driver.quantity.kind)}" for driver in plan.drivers]


def effort_inputs(plan: SolvePlan) -> list[str]:
    """Return the names of the inputs for all efforts: of the drivers, then of loads.

    Raises:
        RequestError: An effort of a driver has the name of a load's input.

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
