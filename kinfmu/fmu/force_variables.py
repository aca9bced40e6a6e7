"""The variables of forces: efforts, inertias and energies, and inputs for external loads, with their dependencies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from kinfmu.equations.graph import Node, symbols
from kinfmu.errors import RequestError, listed, suggestion
from kinfmu.fmu.interface import Variable
from kinfmu.mechanism import Mechanism
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import ForceSteps, force_names
from kinfmu.plan.reactions import reaction_names_of
from kinfmu.plan.steps import Assignment, derivative_name
from kinfmu.plan.trace import parameter_symbol
from kinfmu.units import ForceName, InputName, Quantity, unit_of

_WORDS = {
    "torque": "Torque that the drive must apply for this motion",
    "force": "Force that the drive must apply for this motion",
    "power": "Power of the drive into the mechanism",
    "bias_torque": "Torque at an acceleration of 0",
    "bias_force": "Force at an acceleration of 0",
    "reduced_inertia": "Change of its effort with its acceleration",
    "kinetic_energy": "Kinetic energy of all bodies",
    "potential_energy": "Potential energy of gravity and of loads that store energy",
}


def chosen_outputs(
    mechanism: Mechanism, outputs: Sequence[str] | None
) -> tuple[list[str] | None, tuple[ForceName, ...]]:
    """Return the coordinates (None: all) and the forces among the outputs requested; default: all of both.

    Raises:
        RequestError: The outputs are reactions, or forces alone.

    """
    known = force_names(mechanism)
    if outputs is None or isinstance(outputs, str) or not known:
        return outputs, known if outputs is None else ()  # type: ignore[return-value]  # a text is refused later
    reactions = reaction_names_of(mechanism)
    for name in outputs:
        if name in reactions:
            raise RequestError(
                f"outputs: '{name}' is a reaction, and FMUs have no reactions yet: read them of a run; "
                f"forces of an FMU: {listed(known)}"
            )
    coordinates = [name for name in outputs if name not in known]
    if not coordinates:
        raise RequestError(
            f"outputs: {listed(outputs)}: name a coordinate, too, such as '{mechanism.coordinate_names[0]}'"
        )
    all_names = [*mechanism.coordinate_names, *known]
    for name in coordinates:
        near = suggestion(name, all_names)
        if name not in all_names and any(f"'{force}'" in near for force in known):
            raise RequestError(f"outputs: '{name}' is not one{near}; forces: {listed(known)}")
    return coordinates, tuple(name for name in known if name in outputs)


def load_variables(mechanism: Mechanism) -> Iterator[Variable]:
    """Yield the inputs for the efforts of external loads."""
    for load in mechanism.loads:
        for name, kind in zip(load.inputs(), load.kinds(), strict=False):
            effort = "torque" if kind == "angle" else "force"
            yield Variable(
                name,
                "Real",
                "input",
                "continuous",
                f"Load {load.name}: {effort}",
                unit=unit_of(Quantity(effort), mechanism.length_unit),
                start=0.0,
            )


def force_variables(plan: SolvePlan, steps: ForceSteps) -> Iterator[Variable]:
    """Yield the outputs of a force stage."""
    behind = _behind_symbols(plan, steps)
    order = [*(name for driver in plan.drivers for name in driver.inputs), *_load_inputs(plan.mechanism)]
    for name, node in zip(steps.names, steps.results, strict=True):
        found = _of_node(node, behind)
        own = next((driver.inputs for driver in plan.drivers if driver.name == name.owner), None)
        if own is not None:
            found |= {own[0]}
        if name.noun.startswith("bias_"):  # the terms in accelerations cancel
            found -= {driver.inputs[2] for driver in plan.drivers}
        inputs = tuple(one for one in order if one in found)
        drivers = {driver.name for driver in plan.drivers if driver.inputs[0] in found}
        constants = tuple(constant.name for constant in plan.law_constants if constant.driver in drivers)
        has_rates = any(found & set(driver.inputs[1:]) for driver in plan.drivers)
        parameters = tuple(one.name for one in plan.parameters if parameter_symbol(one.name) in found)
        yield Variable(
            name,
            "Real",
            "output",
            "continuous",
            _description(name),
            initial="calculated",
            unit=unit_of(name.quantity, plan.mechanism.length_unit),
            dependencies=inputs,
            initial_dependencies=(
                *inputs,
                *constants,
                "driven_by_time",
                *(("rates",) if has_rates else ()),
                *parameters,
            ),
        )


def _description(name: ForceName) -> str:
    if not name.owner:
        return _WORDS[name.noun]
    noun, _, other = name.noun.partition(".")
    if other:
        return f"Driver {name.owner}: change of its effort with the acceleration of driver {other}"
    words = _WORDS[noun]
    return f"Driver {name.owner}: {words[0].lower()}{words[1:]}"


def _load_inputs(mechanism: Mechanism) -> list[InputName]:
    return [name for load in mechanism.loads for name in load.inputs()]


def _behind_symbols(plan: SolvePlan, steps: ForceSteps) -> dict[str, frozenset[str]]:
    """Return inputs and parameters, by the names of their symbols, behind each symbol that a stage reads.

    Co-simulation may estimate speeds and accelerations from the driver's values, so these depend on the values too.
    """
    behind: dict[str, frozenset[str]] = {}
    for driver in plan.drivers:
        value, speed, acceleration = driver.inputs
        behind |= {value: frozenset({value}), speed: frozenset({value, speed})}
        behind[acceleration] = frozenset({value, acceleration})
    for name in plan.unknowns:
        drivers = plan.depends(name)
        parameters = frozenset(parameter_symbol(parameter) for parameter in plan.parameters_of(name))
        for order in range(3):
            moved: Iterable[str] = (one for k in drivers for one in plan.drivers[k].inputs[: order + 1])
            behind[name.derivative(order)] = frozenset(moved) | parameters
        for k in range(len(plan.drivers)):
            behind[derivative_name(name, k)] = behind[name]
    for step in steps.steps:
        if isinstance(step, Assignment):
            behind[step.name] = _of_node(step.node, behind)
    return behind


def _of_node(node: Node, behind: dict[str, frozenset[str]]) -> frozenset[str]:
    names = [symbol.name for symbol in symbols([node])]
    return frozenset().union(*(behind.get(name, frozenset({name})) for name in names))
