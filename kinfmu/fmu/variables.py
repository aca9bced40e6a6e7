"""The variables of the FMU of a plan: their names, units, start values and dependencies."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, NamedTuple

from kinfmu.analysis.singular import DriverRange
from kinfmu.codegen.solve_bound import solve_bound
from kinfmu.fmu.force_variables import force_parts, law_constant
from kinfmu.fmu.interface import RATES_TYPE, STATUS_TYPE, Drive, Interface, InterfacePart, Variable
from kinfmu.fmu.owned_motion import with_states
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node, reachable
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.trace import is_parameter
from kinfmu.solver.python.pose import Status
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.solver.python.trusted_step import LONGEST_STEP
from kinfmu.units import CoordinateName, Quantity, unit_of

_INSIDE = 1e-12  # of a range: how far declared limits are from those found, which round-off may miss
SMALLEST_TOLERANCE = 1e-15  # round-off: below it no sample would be ok
_COORDINATE_WORDS = {
    "x": ("x", "x velocity", "x acceleration"),
    "y": ("y", "y velocity", "y acceleration"),
    "phi": ("Angle", "Angular velocity", "Angular acceleration"),
}
_ORDER_WORDS = ("", "rate of ", "acceleration of ")
_MARGIN_TEXT = "1 / condition or relative determinant, smallest over the blocks: 0 at a singular point"
_STATUS_TEXT = "Quality of the sample: the outputs are valid for 0 to 2, of the last good pose for 3 to 5"
_OK_TEXT = "true: solver.status is 0 to 2, the outputs are valid; false: it is 3 to 5, they are of the last good pose"

_TOLERANCE = Variable(
    "solver.tolerance",
    "Real",
    "parameter",
    "tunable",
    "Residual, relative to the mechanism's size, above which a sample is not ok",
    initial="exact",
    unit="1",
    start=TOLERANCE,
    minimum=SMALLEST_TOLERANCE,
    maximum=1.0,
)
_DRIVEN_BY_TIME = Variable(
    "driven_by_time",
    "Boolean",
    "parameter",
    "fixed",
    "true: the law in the mechanism file drives; false: the inputs drive",
    initial="exact",
)
_RATES = Variable(
    "rates",
    "Enumeration",
    "parameter",
    "fixed",
    "Speeds and accelerations of drivers: wired: the inputs, also if 0; estimated: from the driver's values, of order "
    "2 and 1; auto: estimated until the input is first other than 0. Model exchange: always wired",
    initial="exact",
    start=int(Rates.AUTO),
    minimum=int(min(Rates)),
    maximum=int(max(Rates)),
    declared_type=RATES_TYPE,
)
_MESSAGE = Variable(
    "solver.message",
    "String",
    "local",
    "discrete",
    "Why the pose is unreachable: driver, value and limit; empty if solver.ok is true",
    initial="calculated",
)
_MOST_WORK = Variable(
    "solver.most_work",
    "Integer",
    "parameter",
    "fixed",
    "Pose solves that a pose may take after initialization: a step whose pose needs more is discarded; 0: no limit",
    initial="exact",
    start=0,
    minimum=0,
)
_TIME = Variable("time", "Real", "independent", "continuous", "Time", unit="s")


def interface(
    plan: SolvePlan,
    drive: Drive = "time",
    *,
    has_time: bool = False,
    has_work: bool = False,
    forces: Mapping[str, ForceSteps] = MappingProxyType({}),
    starts: Sequence[float] = (),
    reach: DriverRange | None = None,
) -> Interface:
    """Return the variables of the FMU of a plan.

    Args:
        plan: Plan of the mechanism.
        drive: Default of the parameter `driven_by_time`: 'time' (true) or 'inputs' (false); 'torque': angles and speeds
            are states, and efforts are inputs.
        has_time: True for FMI 3.0: time is the last variable, and what the drivers move depends on it and on tunable
            parameters, which FMI 3.0 counts as known after initialization.
        has_work: True for an FMU that counts and limits the work of a step: a native one without an integrator.
        forces: Stages of the forces that are outputs, by part. Default: none.
        starts: With 'torque': value and speed of each driver at the start.
        reach: Range of the only driver. Its limits are minimum and maximum of the driver's input, unless parameters
            change them. Default: unknown.

    Returns:
        The variables, part by part.

    Raises:
        FmuError: If two variables have the same name.

    """
    mechanism = plan.mechanism
    linear = linear_inputs(plan)
    lists: dict[str, Iterable[Variable]] = {
        "inputs": _inputs(plan, reach),
        "values": [_output(plan, name, 0, linear[name]) for name in plan.outputs],
        "rates": [_output(plan, name, 1, linear[name]) for name in plan.outputs],
        "accelerations": [_output(plan, name, 2, linear[name]) for name in plan.outputs],
        "residual": [
            _solver_output(plan, "solver.residual", "Largest residual relative to the mechanism's size", minimum=0.0)
        ],
        "margin": [_solver_output(plan, "solver.margin", _MARGIN_TEXT, minimum=0.0)],
        "errors": _errors(plan),
        "watch": [
            _solver_output(plan, f"watch.{name}", f"Residual of redundant row {name}, relative to the mechanism's size")
            for name in plan.watch_names
        ],
        "driven": _driven(plan),
        "constants": _law_constants(plan),
        "parameters": _parameters(plan),
        "tolerance": [_TOLERANCE],
        "fixed": _fixed(plan),
        **force_parts(plan, forces),
        "counts": [
            _solver_output(
                plan, "solver.status", _STATUS_TEXT, kind="Enumeration", minimum=min(Status), maximum=max(Status)
            ),
            _solver_output(plan, "solver.iterations", "Newton iterations of this pose", kind="Integer", minimum=0),
        ],
        "ok": [_solver_output(plan, "solver.ok", _OK_TEXT, kind="Boolean")],  # for hosts that read no enumerations
        "drive": [replace(_DRIVEN_BY_TIME, start=drive == "time")],
        "rate_source": [_RATES],
        "message": [_MESSAGE],
        **({"work": [_work(plan), _MOST_WORK]} if has_work else {}),
    }
    parts = [InterfacePart(name, tuple(variables)) for name, variables in lists.items()]
    if drive == "torque":
        parts = with_states(plan, parts, starts, has_time=has_time)
    if has_time:
        owns = drive == "torque"  # then only forces and laws of loads depend on time
        tunable = {variable.name for part in parts for variable in part.variables if variable.variability == "tunable"}
        parts = [
            InterfacePart(part.name, tuple(_in_fmi3(one, tunable, has_time=not owns) for one in part.variables))
            for part in parts
        ]
        parts.append(InterfacePart("time", (_TIME,)))
    return Interface(
        mechanism.name, mechanism.title, mechanism.length_unit, mechanism.run, len(plan.coordinates), tuple(parts)
    )


def _in_fmi3(variable: Variable, tunable: Collection[str], *, has_time: bool) -> Variable:
    """Return the variable with the dependencies of FMI 3.0: also tunable parameters, and time, if it has any.

    Fixed parameters are not among the dependencies of outputs: they can no longer change.
    """
    if not variable.dependencies:
        return variable
    initial = variable.initial_dependencies or ()
    now = tuple(name for name in initial if name in tunable)
    time = (_TIME.name,) if has_time else ()
    return replace(
        variable,
        dependencies=(*variable.dependencies, *now, *time),
        initial_dependencies=(*initial, *time),
    )


def _inputs(plan: SolvePlan, reach: DriverRange | None) -> Iterator[Variable]:
    """Yield the inputs. Values start as the law does, so a fresh FMU has a pose; a rate that stays 0 is not wired."""
    mechanism = plan.mechanism
    nominal = _nominal(plan)
    starts = {driver.name: float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers}
    for driver in plan.drivers:
        for order, name in enumerate(driver.inputs):
            least, most = _limits(plan, reach, starts[driver.name]) if not order else (None, None)
            wiring = " (the input or an estimate: see parameter rates)" if order else ""
            yield Variable(
                name,
                "Real",
                "input",
                "continuous",
                f"Driver {driver.name}: {_ORDER_WORDS[order]}{driver.quantity.kind}{wiring}",
                unit=unit_of(Quantity(driver.quantity.kind, order), mechanism.length_unit),
                start=0.0 if order else starts[driver.name],
                minimum=least,
                maximum=most,
                nominal=nominal if driver.quantity.kind == "length" and not order else None,
            )


def _limits(plan: SolvePlan, reach: DriverRange | None, start: float) -> tuple[float | None, float | None]:
    """Return smallest and largest value of the only driver; None where there is no limit, or it is not certain."""
    if reach is None or plan.parameters:
        return None, None
    low, high = reach.low, reach.high
    if not (low is None or low <= start) or not (high is None or start <= high):
        return None, None
    inside = _INSIDE * (1.0 if low is None or high is None else high - low)
    return None if low is None else low + inside, None if high is None else high - inside


def _nominal(plan: SolvePlan) -> float | None:
    """Return the usual magnitude of lengths, a power of ten."""
    magnitude = 10.0 ** round(math.log10(plan.size))
    return None if magnitude == 1.0 else magnitude


def _output(plan: SolvePlan, name: CoordinateName, order: int, linear_in: tuple[str, ...]) -> Variable:
    kind = "body" if name.owner in {body.name for body in plan.mechanism.bodies} else "point"
    drivers = plan.depends(name)
    return Variable(
        name.derivative(order),
        "Real",
        "output",
        "continuous",
        f"{_COORDINATE_WORDS[name.axis][order]} of {kind} {name.owner} in the world",
        initial="calculated",
        unit=unit_of(name.quantity(order), plan.mechanism.length_unit),
        nominal=None if name.is_angle or order else _nominal(plan),
        derivative_of=name.derivative(order - 1) if order else None,
        dependencies=_input_names(plan, drivers, order, linear_in),
        linear_in=() if order else linear_in,
        initial_dependencies=(*_initial_names(plan, drivers, order, linear_in), *plan.parameters_of(name)),
    )


def _input_names(
    plan: SolvePlan, drivers: tuple[int, ...], order: int, linear_in: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Return the inputs that a quantity of the given order depends on.

    A position depends on the value, a rate also on the speed, an acceleration on all three. The acceleration of a
    quantity that is linear in the value does not depend on the speed, but it still depends on the value, from which
    co-simulation may estimate it: declared dependencies hold for all settings of the parameters.
    """
    names: list[str] = []
    for k in drivers:
        inputs = plan.drivers[k].inputs
        names += (inputs[0], inputs[2]) if order == 2 and inputs[0] in linear_in else inputs[: order + 1]
    return tuple(names)


def _initial_names(
    plan: SolvePlan, drivers: tuple[int, ...], order: int, linear_in: tuple[str, ...] = (), *, tolerance: bool = False
) -> tuple[str, ...]:
    """Return the dependencies at initialization, when parameters, such as the law's constants, count as inputs too."""
    if not drivers:
        return ()
    behind = {plan.drivers[k].name for k in drivers}
    constants = tuple(constant.name for constant in plan.law_constants if constant.owner in behind)
    extra = (_TOLERANCE.name,) if tolerance else ()
    rates = (_RATES.name,) if order else ()
    return (*_input_names(plan, drivers, order, linear_in), *constants, *extra, "driven_by_time", *rates)


def _solver_output(
    plan: SolvePlan,
    name: str,
    description: str,
    order: int = 0,
    *,
    kind: Literal["Real", "Integer", "Enumeration", "Boolean"] = "Real",
    minimum: float | None = None,
    maximum: float | None = None,
) -> Variable:
    every = tuple(range(len(plan.drivers)))
    return Variable(
        name,
        kind,
        "output",
        "continuous" if kind == "Real" else "discrete",
        description,
        initial="calculated",
        unit="1" if kind == "Real" else None,
        minimum=minimum,
        maximum=maximum,
        declared_type=STATUS_TYPE if kind == "Enumeration" else None,
        dependencies=_input_names(plan, every, order),
        initial_dependencies=(
            *_initial_names(plan, every, order, tolerance=kind in ("Enumeration", "Boolean")),
            *(parameter.name for parameter in plan.parameters),
        ),
    )


def _errors(plan: SolvePlan) -> Iterator[Variable]:
    for order, suffix in enumerate(("q", "qd", "qdd")):
        text = (
            f"Estimated error of {suffix}: the largest among the outputs, lengths relative to the mechanism's size; "
            f"{UNKNOWN_ERROR:g} if there is no estimate"
        )
        yield _solver_output(plan, f"solver.error_{suffix}", text, order, minimum=0.0, maximum=UNKNOWN_ERROR)


def _work(plan: SolvePlan) -> Variable:
    bound = solve_bound(plan)
    return Variable(
        "solver.work",
        "Integer",
        "local",
        "discrete",
        f"Pose solves of this pose: as a rule 1 if drivers move by at most {LONGEST_STEP:g} rad or sizes, and more "
        f"near singular points. Each takes at most {bound.corrections} Newton corrections, {bound.operations} "
        f"operations and {bound.functions} sines, cosines and the like",
        initial="calculated",
    )


def _driven(plan: SolvePlan) -> Iterator[Variable]:
    """Yield the driver values in effect: of the law, or of the inputs, with estimates for rates that are not wired."""
    for driver in plan.drivers:
        for order, name in enumerate(driver.inputs):
            yield Variable(
                f"driven.{name}",
                "Real",
                "local",
                "continuous",
                f"Driver {driver.name}, in effect: {_ORDER_WORDS[order]}{driver.quantity.kind}",
                initial="calculated",
                unit=unit_of(Quantity(driver.quantity.kind, order), plan.mechanism.length_unit),
                derivative_of=f"driven.{driver.inputs[order - 1]}" if order else None,
            )


def _law_constants(plan: SolvePlan) -> Iterator[Variable]:
    for constant in plan.law_constants:
        yield law_constant(constant, "Driver", plan.mechanism.length_unit)


def _parameters(plan: SolvePlan) -> Iterator[Variable]:
    for name, value, quantity, description in plan.parameters:
        yield Variable(
            name,
            "Real",
            "parameter",
            "fixed",
            description or f"Parameter {name} of the mechanism",
            initial="exact",
            unit=unit_of(quantity, plan.mechanism.length_unit),
            start=value,
        )


def _fixed(plan: SolvePlan) -> Iterator[Variable]:
    """Yield the coordinates that the joints fix: constants, or values that follow from parameters."""
    for name in plan.fixed_nodes:
        parameters = plan.parameters_of(name)
        yield Variable(
            name,
            "Real",
            "calculatedParameter" if parameters else "local",
            "fixed" if parameters else "constant",
            f"{name.owner}: {name.axis}, fixed by the joints",
            initial="calculated" if parameters else "exact",
            unit=unit_of(name.quantity(), plan.mechanism.length_unit),
            start=None if parameters else plan.fixed[name],
            initial_dependencies=parameters or None,
        )


class _Dependence(NamedTuple):
    """Inputs that a number depends on: with a factor of parameters and constants, and in any other way."""

    linear: frozenset[str]
    other: frozenset[str]

    @property
    def every(self) -> frozenset[str]:
        return self.linear | self.other


_NONE = _Dependence(frozenset(), frozenset())


def linear_inputs(plan: SolvePlan) -> dict[str, tuple[str, ...]]:
    """Return, for each output of a plan, the driver values in which it is linear, in their order.

        y = sum_k f_k u_k + rest

    where f_k depends on parameters and constants alone and the rest on other inputs. Unknowns
    of Newton's method count as linear in no input, even if they are.
    """
    inputs = tuple(driver.inputs[0] for driver in plan.drivers)
    known: dict[str, _Dependence] = {name: _Dependence(frozenset((name,)), frozenset()) for name in inputs}
    for block in plan.blocks:
        known |= dict.fromkeys(block.unknowns, _Dependence(frozenset(), frozenset(inputs)))
        for name, motion in block.assigned:
            known[name] = _Dependence(frozenset(), frozenset(inputs)) if block.unknowns else _of(motion[0], known)
    found = {motion.name: _of(motion.position, known).linear for motion in plan.outputs_motion}
    return {name: tuple(one for one in inputs if one in linear) for name, linear in found.items()}


def _of(node: Node, known: dict[str, _Dependence]) -> _Dependence:
    """Return the dependence of a formula, from those of its symbols."""
    of: dict[Node, _Dependence] = {}
    for one in reachable([node]):  # arguments first
        if one.op == "symbol":
            of[one] = _NONE if is_parameter(one) else known[one.name]
            continue
        arguments = [of[arg] for arg in one.args]
        moving = [argument for argument in arguments if argument.every]
        every = frozenset().union(*(argument.every for argument in moving))
        linear: frozenset[str] = frozenset()
        if one.op in ("+", "-", "neg"):
            linear = every - frozenset().union(*(argument.other for argument in moving))
        elif (one.op == "*" and len(moving) == 1) or (one.op == "/" and not arguments[1].every):
            linear = frozenset().union(*(argument.linear for argument in moving))
        of[one] = _Dependence(linear, every - linear)
    return of[node]
