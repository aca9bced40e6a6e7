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
from kinfmu.errors import RequestError
from kinfmu.fmu.force_variables import load_variables
from kinfmu.fmu.interface import Part, Variable
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.loads.following import Following
from kinfmu.mechanism.mechanism import require_masses
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.forces import ForceSteps, effort_noun, force_steps
from kinfmu.plan.led_laws import LedLaws, led_laws
from kinfmu.plan.mechanics import Mechanics
from kinfmu.solver.python.law_breaks import LEAST_TOLERANCE, MOST_TOLERANCE, STEP_TOLERANCE
from kinfmu.units import METRES, Quantity, unit_of


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


def effort_names(plan: SolvePlan) -> list[str]:
    """Return the names of the inputs for the efforts of the drivers, such as 'crank_torque'."""
    return [f"{driver.name}_{effort_noun(driver.quantity.kind)}" for driver in plan.drivers]


def depends_on_time(mechanism: Mechanism) -> bool:
    """Return whether a load follows a law over time, so that accelerations depend on it."""
    return any(
        isinstance(load, Following) and load.over is None and not isinstance(load.law, External)
        for load in mechanism.loads
    )


def with_states(plan: SolvePlan, parts: Iterable[Part], starts: Sequence[float], *, has_time: bool) -> list[Part]:
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
        by_name = dict([*items[:at], *((name, Part(name, one)) for name, one in added.items()), *items[at:]])
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
            result.append(Part(STATES, tuple(_states(plan, starts, behind, constants))))
        elif name == "constants":  # the laws of drivers have no effect
            result.append(Part(name, ()))
        elif name == "tolerance":
            result.append(Part(name, (*part.variables, INTEGRATOR_TOLERANCE)))
        else:
            dropped = {constant.name for constant in plan.law_constants} | set(_GONE)
            found = (_behind(one, behind, constants, dropped) for one in part.variables)
            result.append(Part(name, tuple(found)))
        if name == "fixed":
            result.append(Part(EFFORTS, tuple(_efforts(plan))))
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
