"""The variables of forces: efforts, energies and reactions, and inputs for external loads, with their dependencies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from kinfmu.codegen.forces import STAGES
from kinfmu.errors import RequestError, listed, suggestion
from kinfmu.fmu.interface import Variable
from kinfmu.mechanism import LawConstant, Mechanism
from kinfmu.mechanism.force_names import external_names
from kinfmu.mechanism.joints import CamFlatFace, CamOscillating, CamRoller, CamTranslating, Joint
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import load_inputs
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.forces import ForceSteps, force_names, force_steps
from kinfmu.plan.reactions import reaction_names_of, reaction_steps, shaking_steps
from kinfmu.plan.steps import Assignment, derivative_name, law_symbol
from kinfmu.plan.trace import parameter_symbol
from kinfmu.plan.undetermined import shared_reactions, unknown_contacts, why_unknown
from kinfmu.units import ForceName, Quantity, unit_of

_WORDS = {
    "torque": "Torque that the drive must apply for this motion",
    "force": "Force that the drive must apply for this motion",
    "power": "Power of the drive into the mechanism",
    "bias_torque": "Torque at an acceleration of 0",
    "bias_force": "Force at an acceleration of 0",
    "reduced_inertia": "Change of its effort with its acceleration",
    "kinetic_energy": "Kinetic energy of all bodies",
    "potential_energy": "Potential energy of gravity and of loads that store energy",
    "shaking_force_x": "Force on the ground, along x",
    "shaking_force_y": "Force on the ground, along y",
    "shaking_moment": "Moment on the ground about its origin",
}
_ROWS = {
    "force": "force along the direction that it holds",
    "force_x": "force along x",
    "force_y": "force along y",
    "moment": "moment",
}
_OF_LOADS = {
    "force": "force along the line of its points, positive where it pushes them apart",
    "length": "distance of its points",
    "torque": "torque on its second body, counter-clockwise",
    "angle": "angle of its second body from its first",
}
_OF_CAMS = {
    CamRoller: "force of the cam on its follower, from pole to roller, positive where pressed",
    CamFlatFace: "force of the cam on its follower, along the face's normal, positive where pressed",
    CamTranslating: "force of the cam on its follower, along the lift's axis, positive where pressed if the axis "
    "points away from the cam",
    CamOscillating: "moment of the cam on its follower, counter-clockwise; positive where pressed if the lift moves "
    "it away from the cam",
}


def chosen_outputs(
    mechanism: Mechanism, outputs: Sequence[str] | None
) -> tuple[list[str] | None, tuple[ForceName, ...]]:
    """Return the coordinates (None: all) and the forces among the outputs requested; default: all of both.

    Raises:
        RequestError: A name is like that of a force, and no output.

    """
    external = external_names(mechanism)  # these are inputs
    known = (*(name for name in force_names(mechanism) if name not in external), *reaction_names_of(mechanism))
    if outputs is None or isinstance(outputs, str) or not known:
        return outputs, known if outputs is None else ()  # type: ignore[return-value]  # a text is refused later
    coordinates = [name for name in outputs if name not in known]
    all_names = [*mechanism.coordinate_names, *known]
    for name in coordinates:
        near = suggestion(name, all_names)
        if name not in all_names and any(f"'{force}'" in near for force in known):
            raise RequestError(f"outputs: '{name}' is not one{near}; forces: {listed(known)}")
    return coordinates, tuple(name for name in known if name in outputs)


def force_stages(plan: SolvePlan, names: Sequence[str], *, are_default: bool) -> dict[str, ForceSteps]:
    """Return the steps to the forces of an FMU, by the parts of its variables; none for parts without any.

    Args:
        plan: The plan.
        names: Of forces and reactions.
        are_default: They were not requested: those that are undetermined are left out.

    Raises:
        RequestError: A reaction that was requested is undetermined.

    """
    shared, contacts = shared_reactions(plan), unknown_contacts(plan)
    reasons: dict[str, str] = {
        name: f"[joints.{cam}] gives no contact force: {why_unknown(plan, _joint(plan, cam))}"  # type: ignore[arg-type]
        for cam, loaded in contacts.items()
        for name in loaded
    }
    reasons |= {name: f"rows {listed(rows)} share its load in an unknown way" for name, rows in shared.items()}
    for name in () if are_default else names:
        if name in reasons:
            raise RequestError(f"outputs: '{name}' is undetermined: {reasons[name]}")
    found = {
        "forces": force_steps(plan, names, coefficients="given"),
        "reactions": reaction_steps(plan, [name for name in names if name not in reasons]),
        "shaking": shaking_steps(plan, names),
    }
    return {stage: found[stage] for stage in STAGES if found[stage].names}


def load_variables(mechanism: Mechanism) -> Iterator[Variable]:
    """Yield the inputs for the efforts of external loads, then the constants of the laws of loads."""
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
    for constant in mechanism.load_constants:
        yield law_constant(constant, "Load", mechanism.length_unit)


def law_constant(constant: LawConstant, what: str, length_unit: str) -> Variable:
    """Return the parameter for a constant of a law; what: owns it, 'Driver' or 'Load'."""
    return Variable(
        constant.name,
        "Real",
        "parameter",
        "tunable",
        f"{what} {constant.owner}: {constant.key} of its law",
        initial="exact",
        unit=unit_of(constant.quantity, length_unit),
        start=constant.value,
        minimum=0.0 if constant.is_positive else None,
    )


def force_parts(plan: SolvePlan, stages: Mapping[str, ForceSteps]) -> dict[str, Iterable[Variable]]:
    """Return the parts of the variables of forces, by name: loads, then one for each stage; none without stages."""
    if not stages:
        return {}
    loads = {"loads": load_variables(plan.mechanism)}
    return loads | {name: force_variables(plan, stages[name]) if name in stages else () for name in STAGES}


def force_variables(plan: SolvePlan, steps: ForceSteps) -> Iterator[Variable]:
    """Yield the outputs of a force stage."""
    behind = _behind_symbols(plan, steps)
    order = [*(name for driver in plan.drivers for name in driver.inputs), *load_inputs(plan)]
    for name, node in zip(steps.names, steps.results, strict=True):
        found = _of_node(node, behind)
        own = next((driver.inputs for driver in plan.drivers if driver.name == name.owner), None)
        if own is not None:
            found |= {own[0]}
        if name.noun.startswith("bias_"):  # the terms in accelerations cancel
            found -= {driver.inputs[2] for driver in plan.drivers}
        inputs = tuple(one for one in order if one in found)
        drivers = {driver.name for driver in plan.drivers if driver.inputs[0] in found}
        constants = tuple(constant.name for constant in plan.law_constants if constant.owner in drivers)
        constants += tuple(constant.name for constant in plan.load_constants if law_symbol(constant.name) in found)
        has_rates = any(found & set(driver.inputs[1:]) for driver in plan.drivers)
        parameters = tuple(one.name for one in plan.parameters if parameter_symbol(one.name) in found)
        yield Variable(
            name,
            "Real",
            "output",
            "continuous",
            variable_description(plan, name),
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


def variable_description(plan: SolvePlan, name: ForceName) -> str:
    if not name.owner:
        return _WORDS[name.noun]
    if name in reaction_names_of(plan.mechanism):
        joint = _joint(plan, name.owner)
        if type(joint) in _OF_CAMS:
            return f"Joint {name.owner}: {_OF_CAMS[type(joint)]}"
        return f"Joint {name.owner}: {_ROWS.get(name.noun, name.noun)} of its first body on its second"
    if any(load.name == name.owner for load in plan.mechanism.loads):
        return f"Load {name.owner}: {_OF_LOADS[name.noun]}"
    noun, _, other = name.noun.partition(".")
    if other:
        return f"Driver {name.owner}: change of its effort with the acceleration of driver {other}"
    words = _WORDS[noun]
    return f"Driver {name.owner}: {words[0].lower()}{words[1:]}"


def _joint(plan: SolvePlan, name: str) -> Joint:
    return next(one for one in plan.mechanism.joints if one.name == name)


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
            continue
        matrix = frozenset().union(*(_of_node(node, behind) for row in step.jacobian for node in row))
        for column, solved in zip(step.columns, step.names, strict=True):
            found = matrix.union(*(_of_node(node, behind) for node in column))
            behind |= dict.fromkeys(solved, found)
    return behind


def _of_node(node: Node, behind: dict[str, frozenset[str]]) -> frozenset[str]:
    names = [symbol.name for symbol in symbols([node])]
    return frozenset().union(*(behind.get(name, frozenset({name})) for name in names))
