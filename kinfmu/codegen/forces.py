"""The force stages of an FMU, and where their numbers are: lists of the pose, the drivers and the host."""

from __future__ import annotations

from kinfmu.plan import SolvePlan
from kinfmu.plan.steps import derivative_name
from kinfmu.plan.trace import parameter_symbol

STAGES = ("forces", "reactions", "shaking")  # each is a part of the FMU's variables and a function of its own
ARGUMENTS = ("time", "u", "ud", "udd", "z", "zd", "zdd", "slopes", "efforts", "parameters")


def load_inputs(plan: SolvePlan) -> tuple[str, ...]:
    """Return the names of the inputs that give efforts of external loads."""
    return tuple(name for load in plan.mechanism.loads for name in load.inputs())


def places_of_symbols(plan: SolvePlan) -> dict[str, str]:
    """Return, for each symbol that a force stage may read, an expression such as 'zd[2]'.

    z: unknowns of all blocks, with zd and zdd in time; slopes: dz/du, for one driver after another.
    """
    places = {"time": "time"}
    count = len(plan.unknowns)
    for place, name in enumerate(plan.unknowns):
        places |= {name.derivative(order): f"{z}[{place}]" for order, z in enumerate(("z", "zd", "zdd"))}
        for k in range(len(plan.drivers)):
            places[derivative_name(name, k)] = f"slopes[{k * count + place}]"
    for k, driver in enumerate(plan.drivers):
        places |= {name: f"{u}[{k}]" for name, u in zip(driver.inputs, ("u", "ud", "udd"), strict=True)}
    places |= {name: f"efforts[{k}]" for k, name in enumerate(load_inputs(plan))}
    return places | {
        parameter_symbol(parameter.name): f"parameters[{k}]" for k, parameter in enumerate(plan.parameters)
    }
