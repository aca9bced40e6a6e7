"""The one list of an FMU's variables. Model description, value references and the channels of a run follow from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from kinfmu.errors import FmuError
from kinfmu.fmu.estimated_rates import Rates
from kinfmu.fmu.layout import UNKNOWN_ERROR
from kinfmu.mechanism import Mechanism, RunSettings
from kinfmu.solver.python.status import Status
from kinfmu.units import Quantity, derivative_name, display_units, quantity_of, unit_of

if TYPE_CHECKING:
    from kinfmu.plan import SolvePlan

Drive = Literal["time", "inputs"]
DRIVES: tuple[Drive, ...] = ("time", "inputs")

DEFAULT_TOLERANCE = 1e-9  # residual relative to the mechanism's size above which a sample is not ok
SMALLEST_TOLERANCE = 1e-15  # round-off: no sample would pass below
_COORDINATE_WORDS = {
    "x": ("x", "x velocity", "x acceleration"),
    "y": ("y", "y velocity", "y acceleration"),
    "phi": ("Angle", "Angular velocity", "Angular acceleration"),
}
_WIRING = "an input or estimated, as parameter rates says"
_ORDER_WORDS = ("", "rate of ", "acceleration of ")
_ANGLES_SHOWN_IN_DEGREES = ("rad", "rad/s", "rad/s2")


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU, in FMI's words.

    derivative_of: the variable of which this is the time derivative. declared_type: name of the type of an Enumeration.
    dependencies: the inputs that an output depends on structurally, None where FMI lists none; linear_in: those of them
    whose factor depends on fixed parameters alone; initial_dependencies: inputs and parameters that it depends on when
    the FMU is initialized.
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
        """The unit in which tools show the value at first: degrees for angles, else none."""
        if self.unit in _ANGLES_SHOWN_IN_DEGREES:
            return next(iter(display_units(self.unit)))
        return None


@dataclass(frozen=True)
class Part:
    """Neighbours in the list that a slave computes together, such as the rates of all outputs."""

    name: str
    variables: tuple[Variable, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(variable.name for variable in self.variables)


@dataclass(frozen=True)
class Interface:
    """All variables of an FMU, part by part; the value reference of a variable is its place in the list, from 1.

    FMI 2.0 counts variables from 1 in dependencies, FMI 3.0 names value references there. The two are the same numbers
    here, so a host that takes one for the other reads the same dependencies.

    coordinate_count: how many of the outputs are generalized coordinates (they come first).
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
        """The variables of a part; an FMU without that part has none."""
        return next((part.variables for part in self.parts if part.name == name), ())

    def value_references(self) -> dict[str, int]:
        """Value reference by name."""
        return {variable.name: reference for reference, variable in enumerate(self, start=1)}


def interface(plan: SolvePlan, drive: Drive = "time", *, has_time: bool = False) -> Interface:
    """The variables of the FMU of a plan; `drive` chooses the default of `driven_by_time`.

    has_time: time is a variable, too, the last one, as FMI 3.0 wants it; what the drivers move depends on it, and, as
    FMI 3.0 counts them among what is known after initialization, on tunable parameters.
    """
    from kinfmu.fmu.linear import linear_inputs  # with scipy, which stepping an FMU does not need

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
    start=DEFAULT_TOLERANCE,
    minimum=SMALLEST_TOLERANCE,
    maximum=1.0,
)

STATUS_TYPE, RATES_TYPE = "Status", "Rates"  # names of the enumerations' types

_RATES = Variable(
    "rates",
    "Enumeration",
    "parameter",
    "fixed",
    "Speeds and accelerations of drivers: wired: the inputs, 0 too; estimated: from the driver's values, of order 2 "
    "and 1; auto: estimated until the input is first other than 0. Model exchange: always wired",
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
    "Why the pose cannot be had: driver, value and limit; empty when all is well",
    initial="calculated",
)


def _in_fmi3(variable: Variable, tunable: Collection[str]) -> Variable:
    """Return the variable with what FMI 3.0 counts as known: time and tunable parameters, if it depends on drivers.

    Parameters that are fixed are no dependencies of outputs: they cannot change any more.
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
    """Start value of each input: the law's value at the start of the run, so that a fresh FMU holds a pose; rates 0.

    A rate that stays 0 counts as not wired.
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
    """Inputs that a quantity of the given order depends on.

    A position depends on the value, a rate also on the speed, an acceleration on all three; but what is linear in the
    value accelerates without regard to the speed. It depends on the value all the same, from which co-simulation may
    estimate the acceleration: what is declared holds for every setting of the parameters.
    """
    names: list[str] = []
    for k in drivers:
        inputs = plan.drivers[k].inputs
        names += (inputs[0], inputs[2]) if order == 2 and inputs[0] in linear_in else inputs[: order + 1]
    return tuple(names)


def _initial_names(
    plan: SolvePlan, drivers: tuple[int, ...], order: int, linear_in: tuple[str, ...] = (), *, tolerance: bool = False
) -> tuple[str, ...]:
    """The same at initialization, where parameters are known quantities too: the law's constants may drive."""
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
            f"{UNKNOWN_ERROR:g} where there is no estimate"
        )
        yield _solver_output(plan, every, f"solver.error_{suffix}", text, order, minimum=0.0, maximum=UNKNOWN_ERROR)


def _watches(plan: SolvePlan, every: tuple[int, ...]) -> Iterator[Variable]:
    for name in plan.watch_names:
        text = f"Residual of row {name}, set aside as redundant, relative to the mechanism's size"
        yield _solver_output(plan, every, f"watch.{name}", text)


def _driven(plan: SolvePlan) -> Iterator[Variable]:
    """What drives in effect: the inputs, with estimates for rates not wired, or the law."""
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
    """Coordinates that the joints fix: constants, or what follows from parameters."""
    for name, value in plan.fixed.items():
        owner, _, coordinate = name.rpartition(".")
        parameters = plan.parameters_of(name)
        yield Variable(
            name,
            "Real",
            "calculatedParameter" if parameters else "local",
            "fixed" if parameters else "constant",
            f"{owner}: {coordinate}, which the joints fix",
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
        "How far the numbers can be trusted: 0 to 2 hold numbers, 3 to 5 do not",
        kind="Enumeration",
        minimum=min(Status),
        maximum=max(Status),
    )
    yield _solver_output(plan, every, "solver.iterations", "Newton iterations of this pose", kind="Integer", minimum=0)


def _ok(plan: SolvePlan, every: tuple[int, ...]) -> Variable:
    """The twin of solver.status for hosts that do not read enumerations."""
    text = "true: solver.status is 0 to 2, the outputs hold; false: it is 3 to 5, the outputs are of the last good pose"
    return _solver_output(plan, every, "solver.ok", text, kind="Boolean")
