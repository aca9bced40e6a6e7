"""The list of an FMU's variables, from which model description, value references and channels of a run follow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from kinfmu.errors import FmuError
from kinfmu.fmu.estimated_rates import Rates
from kinfmu.fmu.layout import UNKNOWN_ERROR
from kinfmu.mechanism import Mechanism, RunSettings
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.solver.python.status import Status
from kinfmu.units import Quantity, derivative_name, display_units, quantity_of, unit_of

if TYPE_CHECKING:
    from kinfmu.plan import SolvePlan

Drive = Literal["time", "inputs"]
DRIVES: tuple[Drive, ...] = ("time", "inputs")

SMALLEST_TOLERANCE = 1e-15  # round-off: below it no sample would be ok
_COORDINATE_WORDS = {
    "x": ("x", "x velocity", "x acceleration"),
    "y": ("y", "y velocity", "y acceleration"),
    "phi": ("Angle", "Angular velocity", "Angular acceleration"),
}
_WIRING = "the input or an estimate: see parameter rates"
_ORDER_WORDS = ("", "rate of ", "acceleration of ")
_ANGLES_SHOWN_IN_DEGREES = ("rad", "rad/s", "rad/s2")


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU, in FMI's terms.

    Attributes:
        name: Name, such as "coupler.vx".
        type: FMI 2.0's type.
        causality: FMI's causality.
        variability: FMI's variability.
        description: One line for the user of the FMU.
        initial: FMI's attribute `initial`, if any.
        unit: Unit, such as "rad/s".
        start: Start value.
        minimum: Smallest valid value.
        maximum: Largest valid value.
        derivative_of: Variable of which this is the time derivative.
        declared_type: Name of the type of an Enumeration.
        dependencies: Inputs that an output depends on structurally; None if FMI lists none.
        linear_in: Those of them whose factor depends on fixed parameters alone.
        initial_dependencies: Inputs and parameters that it depends on during initialization.

    """

    name: str
    type: Literal["Real", "Integer", "Enumeration", "Boolean", "String"]
    causality: Literal["input", "output", "parameter", "calculatedParameter", "local", "independent"]
    variability: Literal["constant", "fixed", "tunable", "discrete", "continuous"]
    description: str
    initial: Literal["exact", "calculated"] | None = None
    unit: str | None = None
    start: float | bool | None = None
    minimum: float | None = None
    maximum: float | None = None
    derivative_of: str | None = None
    declared_type: str | None = None
    dependencies: tuple[str, ...] | None = None
    linear_in: tuple[str, ...] = ()
    initial_dependencies: tuple[str, ...] | None = None

    @property
    def display_unit(self) -> str | None:
        """The unit in which tools show the value by default: degrees for angles, else None."""
        if self.unit in _ANGLES_SHOWN_IN_DEGREES:
            return next(iter(display_units(self.unit)))
        return None


@dataclass(frozen=True)
class Part:
    """Neighbouring variables that a slave computes together, such as the rates of all outputs."""

    name: str
    variables: tuple[Variable, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(variable.name for variable in self.variables)


@dataclass(frozen=True)
class Interface:
    """All variables of an FMU, part by part; the value reference of a variable is its place in the list, from 1.

    Dependencies are places counted from 1 in FMI 2.0, and value references in FMI 3.0. The two are the same numbers
    here, so a host that takes one for the other reads the same dependencies.

    Attributes:
        name: Name of the mechanism.
        title: Title of the mechanism.
        length_unit: Unit of length.
        experiment: Default start, stop and step [s].
        coordinate_count: Number of outputs that are generalized coordinates (they come first).
        parts: Variables by part.

    """

    name: str
    title: str
    length_unit: str
    experiment: RunSettings
    coordinate_count: int
    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        twice = [name for name, count in Counter(variable.name for variable in self).items() if count > 1]
        if twice:
            raise FmuError(f"mechanism '{self.name}': two variables of the FMU would be named '{twice[0]}'")

    def __iter__(self) -> Iterator[Variable]:
        for part in self.parts:
            yield from part.variables

    def part(self, name: str) -> tuple[Variable, ...]:
        """Return the variables of a part, none if the FMU does not have that part."""
        return next((part.variables for part in self.parts if part.name == name), ())

    def value_references(self) -> dict[str, int]:
        """Return the value references by name."""
        return {variable.name: reference for reference, variable in enumerate(self, start=1)}


def interface(plan: SolvePlan, drive: Drive = "time", *, has_time: bool = False) -> Interface:
    """Return the variables of the FMU of a plan.

    Args:
        plan: Plan of the mechanism.
        drive: Default of the parameter `driven_by_time`: 'time' (true) or 'inputs' (false).
        has_time: True for FMI 3.0: time is the last variable, and what the drivers move depends on it and on tunable
            parameters, which FMI 3.0 counts as known after initialization.

    """
    from kinfmu.fmu.linear import linear_inputs  # imports scipy, which stepping an FMU does not need

    mechanism = plan.mechanism
    every = tuple(range(len(plan.drivers)))
    depends = {name: plan.depends(name) for name in plan.outputs}
    linear = linear_inputs(plan)
    parts: tuple[Part, ...] = (
        Part("inputs", tuple(_inputs(plan))),
        Part("values", tuple(_output(plan, name, 0, depends[name], linear[name]) for name in plan.outputs)),
        Part("rates", tuple(_output(plan, name, 1, depends[name], linear[name]) for name in plan.outputs)),
        Part("accelerations", tuple(_output(plan, name, 2, depends[name], linear[name]) for name in plan.outputs)),
        Part("residual", (_residual(plan, every),)),
        Part("margin", (_margin(plan, every),)),
        Part("errors", tuple(_errors(plan, every))),
        Part("watch", tuple(_watches(plan, every))),
        Part("driven", tuple(_driven(plan))),
        Part("constants", tuple(_law_constants(plan))),
        Part("parameters", tuple(_parameters(plan))),
        Part("tolerance", (_TOLERANCE,)),
        Part("fixed", tuple(_fixed(plan))),
        Part("counts", tuple(_counts(plan, every))),
        Part("ok", (_ok(plan, every),)),
        Part("drive", (_driven_by_time(drive),)),
        Part("rate_source", (_RATES,)),
        Part("message", (_MESSAGE,)),
    )
    if has_time:
        tunable = {variable.name for part in parts for variable in part.variables if variable.variability == "tunable"}
        dependent = (Part(part.name, tuple(_in_fmi3(one, tunable) for one in part.variables)) for part in parts)
        parts = (*dependent, Part("time", (_TIME,)))
    return Interface(
        mechanism.name, mechanism.title, mechanism.length_unit, mechanism.run, len(plan.coordinates), parts
    )


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

STATUS_TYPE, RATES_TYPE = "Status", "Rates"  # names of the enumerations' types

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

_TIME = Variable("time", "Real", "independent", "continuous", "Time", unit="s")

_MESSAGE = Variable(
    "solver.message",
    "String",
    "local",
    "discrete",
    "Why the pose is unreachable: driver, value and limit; empty if solver.ok is true",
    initial="calculated",
)


def _in_fmi3(variable: Variable, tunable: Collection[str]) -> Variable:
    """Return the variable with the dependencies of FMI 3.0: also time and tunable parameters, if it has any.

    Fixed parameters are not among the dependencies of outputs: they can no longer change.
    """
    if not variable.dependencies:
        return variable
    initial = variable.initial_dependencies or ()
    now = tuple(name for name in initial if name in tunable)
    return replace(
        variable,
        dependencies=(*variable.dependencies, *now, _TIME.name),
        initial_dependencies=(*initial, _TIME.name),
    )


def _driven_by_time(drive: Drive) -> Variable:
    return Variable(
        "driven_by_time",
        "Boolean",
        "parameter",
        "fixed",
        "true: the law in the mechanism file drives; false: the inputs drive",
        initial="exact",
        start=drive == "time",
    )


def start_values(mechanism: Mechanism) -> dict[str, float]:
    """Return the start value of each input by name: the law's value at the start of the run, and 0 for rates.

    So a fresh FMU has a pose. A rate that stays 0 counts as not wired.
    """
    starts = {}
    for driver in mechanism.drivers:
        value, speed, acceleration = driver.inputs()
        starts[value] = float(driver.law.at(mechanism.run.start))
        starts[speed] = starts[acceleration] = 0.0
    return starts


def _inputs(plan: SolvePlan) -> Iterator[Variable]:
    starts = start_values(plan.mechanism)
    for driver in plan.drivers:
        for order, name in enumerate(driver.inputs):
            wiring = f" ({_WIRING})" if order else ""
            yield Variable(
                name,
                "Real",
                "input",
                "continuous",
                f"Driver {driver.name}: {_ORDER_WORDS[order]}{driver.quantity.kind}{wiring}",
                unit=unit_of(Quantity(driver.quantity.kind, order), plan.mechanism.length_unit),
                start=starts[name],
            )


def _output(
    plan: SolvePlan, name: str, order: int, drivers: tuple[int, ...], linear_in: tuple[str, ...] = ()
) -> Variable:
    owner, _, coordinate = name.rpartition(".")
    kind = "body" if owner in {body.name for body in plan.mechanism.bodies} else "point"
    return Variable(
        derivative_name(name, order),
        "Real",
        "output",
        "continuous",
        f"{_COORDINATE_WORDS[coordinate][order]} of {kind} {owner} in the world",
        initial="calculated",
        unit=unit_of(quantity_of(name, order), plan.mechanism.length_unit),
        derivative_of=derivative_name(name, order - 1) if order else None,
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
    prefixes = tuple(f"{plan.drivers[k].name}." for k in drivers)
    constants = tuple(name for name, *_ in plan.law_constants if name.startswith(prefixes))
    extra = (_TOLERANCE.name,) if tolerance else ()
    rates = (_RATES.name,) if order else ()
    return (*_input_names(plan, drivers, order, linear_in), *constants, *extra, "driven_by_time", *rates)


def _solver_output(
    plan: SolvePlan,
    every: tuple[int, ...],
    name: str,
    description: str,
    order: int = 0,
    *,
    kind: Literal["Real", "Integer", "Enumeration", "Boolean"] = "Real",
    minimum: float | None = None,
    maximum: float | None = None,
) -> Variable:
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


def _residual(plan: SolvePlan, every: tuple[int, ...]) -> Variable:
    text = "Largest residual relative to the mechanism's size"
    return _solver_output(plan, every, "solver.residual", text, minimum=0.0)


def _margin(plan: SolvePlan, every: tuple[int, ...]) -> Variable:
    text = "1 / condition or relative determinant, smallest over the blocks: 0 at a singular point"
    return _solver_output(plan, every, "solver.margin", text, minimum=0.0)


def _errors(plan: SolvePlan, every: tuple[int, ...]) -> Iterator[Variable]:
    for order, suffix in enumerate(("q", "qd", "qdd")):
        text = (
            f"Estimated error of {suffix}: the largest among the outputs, lengths relative to the mechanism's size; "
            f"{UNKNOWN_ERROR:g} if there is no estimate"
        )
        yield _solver_output(plan, every, f"solver.error_{suffix}", text, order, minimum=0.0, maximum=UNKNOWN_ERROR)


def _watches(plan: SolvePlan, every: tuple[int, ...]) -> Iterator[Variable]:
    for name in plan.watch_names:
        text = f"Residual of redundant row {name}, relative to the mechanism's size"
        yield _solver_output(plan, every, f"watch.{name}", text)


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
    for name, value, quantity, is_positive in plan.law_constants:
        driver, _, key = name.rpartition(".")
        yield Variable(
            name,
            "Real",
            "parameter",
            "tunable",
            f"Driver {driver}: {key} of its law",
            initial="exact",
            unit=unit_of(quantity, plan.mechanism.length_unit),
            start=value,
            minimum=0.0 if is_positive else None,
        )


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
    for name, value in plan.fixed.items():
        owner, _, coordinate = name.rpartition(".")
        parameters = plan.parameters_of(name)
        yield Variable(
            name,
            "Real",
            "calculatedParameter" if parameters else "local",
            "fixed" if parameters else "constant",
            f"{owner}: {coordinate}, fixed by the joints",
            initial="calculated" if parameters else "exact",
            unit=unit_of(quantity_of(name), plan.mechanism.length_unit),
            start=None if parameters else value,
            initial_dependencies=parameters or None,
        )


def _counts(plan: SolvePlan, every: tuple[int, ...]) -> Iterator[Variable]:
    yield _solver_output(
        plan,
        every,
        "solver.status",
        "Quality of the sample: the outputs are valid for 0 to 2, of the last good pose for 3 to 5",
        kind="Enumeration",
        minimum=min(Status),
        maximum=max(Status),
    )
    yield _solver_output(plan, every, "solver.iterations", "Newton iterations of this pose", kind="Integer", minimum=0)


def _ok(plan: SolvePlan, every: tuple[int, ...]) -> Variable:
    """Return solver.ok, which repeats solver.status for hosts that do not read enumerations."""
    text = "true: solver.status is 0 to 2, the outputs are valid; false: it is 3 to 5, they are of the last good pose"
    return _solver_output(plan, every, "solver.ok", text, kind="Boolean")
