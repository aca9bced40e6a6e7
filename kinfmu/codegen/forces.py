"""The force stages of an FMU, and where their numbers are: lists of the pose, the drivers and the host."""

from __future__ import annotations

from kinfmu.plan import SolvePlan
from kinfmu.plan.steps import derivative_name, law_symbol
from kinfmu.plan.trace import parameter_symbol

STAGES = ("forces", "reactions", "shaking")  # each is a part of the FMU's variables and a function of its own
ARGUMENTS = ("time", "u", "ud", "udd", "z", "zd", "zdd", "slopes", "efforts", "parameters")


def load_inputs(plan: SolvePlan) -> tuple[str, ...]:
    """Return the names of the inputs that give efforts of external loads."""
    return tuple(name for load in plan.mechanism.loads for name in load.inputs())


def places_of_symbols(plan: SolvePlan, *, are_loads_open: bool = True) -> dict[str, str]:
    """Return, for each symbol that a force stage may read, an expression such as 'zd[2]'.

    z: unknowns of all blocks, with zd and zdd in time; slopes: dz/du, for one driver after another; efforts: of
    external loads, then constants of the laws of loads.

    Args:
        plan: The plan.
        are_loads_open: Constants of the laws of loads can be set; else they are numbers.

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
    first = len(load_inputs(plan))
    places |= {
        law_symbol(constant.name): f"efforts[{first + k}]" if are_loads_open else repr(constant.value)
        for k, constant in enumerate(plan.load_constants)
    }
    return places | {
        parameter_symbol(parameter.name): f"parameters[{k}]" for k, parameter in enumerate(plan.parameters)
    }
