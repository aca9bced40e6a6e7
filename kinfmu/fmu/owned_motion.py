"""An FMU that owns the motion of its drivers: efforts are inputs, values and speeds are states.

Its variables are those of an FMU whose drivers inputs move, except that each input of a driver is computed here: value
and speed by integration, the acceleration from the efforts. So what depends on an acceleration depends on all states
and efforts. Its code has reduced inertia, jumps of loads and start values.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from kinfmu.codegen.forces import STAGES
from kinfmu.codegen.python import load_model
from kinfmu.fmu.force_variables import load_variables
from kinfmu.fmu.interface import InterfacePart, Variable
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.loads.load import Following
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import LedLaws, effort_inputs, effort_names, inertia_steps, led_laws
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.forces import ForceSteps, effort_noun
from kinfmu.plan.mechanics import Mechanics
from kinfmu.solver.python.solver import LEAST_TOLERANCE, MOST_TOLERANCE, STEP_TOLERANCE
from kinfmu.units import Quantity, unit_of


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
            jumps = load.law.own_breaks()
            found += [(mechanics.graph.lift(at), mechanics.graph.lift(jumps.period)) for at in jumps.at]
    return tuple(found)


STATES, EFFORTS, INPUTS = "states", "efforts", "inputs"  # parts
INTEGRATOR_TOLERANCE = Variable(
    "integrator.tolerance",
    "Real",
    "parameter",
    "tunable",
    "Error of a step of the integrator: relative to 1 rad or the mechanism's size, and to the speed. Co-simulation",
    initial="exact",
    unit="1",
    start=STEP_TOLERANCE,
    minimum=LEAST_TOLERANCE,
    maximum=MOST_TOLERANCE,
)
_LEFT_OUT = ("driven", "drive", "rate_source")
_GONE = ("driven_by_time", "rates")
_WORDS = (("", "state"), ("rate of ", "state"), ("acceleration of ", "of the efforts"))


def depends_on_time(mechanism: Mechanism) -> bool:
    """Return whether a load follows a law over time, so that accelerations depend on it."""
    return any(
        isinstance(load, Following) and load.over is None and not isinstance(load.law, External)
        for load in mechanism.loads
    )


def with_states(
    plan: SolvePlan, parts: Iterable[InterfacePart], starts: Sequence[float], *, has_time: bool
) -> list[InterfacePart]:
    """Return the parts of an FMU that owns the motion, from those of one that inputs drive.

    Args:
        plan: Plan of the mechanism.
        parts: Of the other FMU, with `loads` and `forces`.
        starts: Value and speed of each driver at the start.
        has_time: True if time is a variable, of which dependencies are stated.

    """
    mechanism = plan.mechanism
    by_name = {part.name: part for part in parts}
    if "loads" not in by_name:  # no force is an output
        added = {"loads": tuple(load_variables(mechanism))} | dict.fromkeys(STAGES, ())
        at = list(by_name).index("fixed") + 1
        items = list(by_name.items())
        by_name = dict([*items[:at], *((name, InterfacePart(name, one)) for name, one in added.items()), *items[at:]])
    loads = [variable.name for variable in by_name["loads"].variables if variable.causality == "input"]
    moving = [name for driver in plan.drivers for name in driver.inputs[:2]]
    time = ["time"] if has_time and depends_on_time(mechanism) else []
    moved_by = (*moving, *effort_names(plan), *loads, *time)
    behind: dict[str, Sequence[str]] = {driver.inputs[2]: moved_by for driver in plan.drivers}
    constants = tuple(constant.name for constant in plan.load_constants)
    result = []
    for name, part in by_name.items():
        if name in _LEFT_OUT:
            continue
        if name == INPUTS:
            result.append(InterfacePart(STATES, tuple(_states(plan, starts, behind, constants))))
        elif name == "constants":  # the laws of drivers have no effect
            result.append(InterfacePart(name, ()))
        elif name == "tolerance":
            result.append(InterfacePart(name, (*part.variables, INTEGRATOR_TOLERANCE)))
        else:
            dropped = {constant.name for constant in plan.law_constants} | set(_GONE)
            found = (_behind(one, behind, constants, dropped) for one in part.variables)
            result.append(InterfacePart(name, tuple(found)))
        if name == "fixed":
            result.append(InterfacePart(EFFORTS, tuple(_efforts(plan))))
    return result


def _states(
    plan: SolvePlan, starts: Sequence[float], behind: Mapping[str, Sequence[str]], constants: tuple[str, ...]
) -> Iterator[Variable]:
    parameters = (*constants, *(parameter.name for parameter in plan.parameters))
    for k, driver in enumerate(plan.drivers):
        for order, (name, (words, origin)) in enumerate(zip(driver.inputs, _WORDS, strict=True)):
            is_state = order < 2
            yield Variable(
                name,
                "Real",
                "output",
                "continuous",
                f"Driver {driver.name}: {words}{driver.quantity.kind} ({origin})",
                initial="exact" if is_state else "calculated",
                unit=unit_of(Quantity(driver.quantity.kind, order), plan.mechanism.length_unit),
                start=starts[2 * k + order] if is_state else None,
                derivative_of=driver.inputs[order - 1] if order else None,
                dependencies=(name,) if is_state else tuple(behind[name]),
                linear_in=(name,) if is_state else (),
                initial_dependencies=None if is_state else (*behind[name], *parameters),
            )


def _efforts(plan: SolvePlan) -> Iterator[Variable]:
    for driver, name in zip(plan.drivers, effort_names(plan), strict=True):
        noun = effort_noun(driver.quantity.kind)
        yield Variable(
            name,
            "Real",
            "input",
            "continuous",
            f"Driver {driver.name}: {noun} of the drive on the mechanism",
            unit=unit_of(Quantity(noun), plan.mechanism.length_unit),
            start=0.0,
        )


def _behind(
    variable: Variable, behind: Mapping[str, Sequence[str]], constants: tuple[str, ...], dropped: set[str]
) -> Variable:
    """Return a variable with states and efforts among its dependencies, in place of accelerations.

    Constants of the laws of loads act on accelerations too, and count during initialization.
    """

    def exact(names: tuple[str, ...] | None, more: tuple[str, ...] = ()) -> tuple[str, ...] | None:
        if names is None:
            return None
        found = [one for name in names for one in behind.get(name, (name,)) if one not in dropped]
        return tuple(dict.fromkeys((*found, *more) if any(name in behind for name in names) else found))

    return replace(
        variable,
        dependencies=exact(variable.dependencies),
        initial_dependencies=exact(variable.initial_dependencies, constants),
    )
