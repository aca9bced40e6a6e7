"""Parameters of a mechanism, and the conversion of texts with a unit and of expressions of parameters into numbers.

Inside an expression all numbers belong to one system of units: kilogram, the file's unit of length, second. So
"m*l**2/12" is right in a file in mm: the moment of inertia comes out in kg mm2, and the last step makes it kg m2. A
parameter such as "10 N" enters as 10000 kg mm/s2. In files in metres nothing is converted.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from itertools import chain
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.members import Members, NumberPath, path_text
from kinfmu.mechanism.number import NumberWithUnit, expression_error, given_unit, read_number
from kinfmu.mechanism.operations import OPERATIONS, UNKNOWN, WORDS, Dimension, ExpressionStep
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.valid import MOST_PARTS, check_line, check_name, check_number, quoted
from kinfmu.units import KINDS, METRES, Quantity, every_unit, length_power

NUMBER = Quantity("number")
_MOST_LISTED = 8  # names of a circle in a message
MOST_PARAMETERS = 10_000


@dataclass(frozen=True)
class Parameter:
    """A number with a name.

    Args:
        value: The number in the units used inside; before a mechanism resolves it also text with a unit or an
            expression of other parameters ("40 mm", "2*a").
        quantity: What it measures. Default: from its unit, else from the key whose value is its name or its negative,
            else a number.
        description: One line for people. Default: none.
        unit: The unit in which the value was written. Default: none.

    """

    value: float
    quantity: Quantity | None = None
    description: str = ""
    unit: str = field(default="", compare=False)

    @property
    def kind(self) -> str:
        """'length', 'angle', 'time', 'number', or a quantity with a mass in it such as 'force'."""
        return (self.quantity or NUMBER).kind

    @property
    def expression(self) -> Expression | None:
        """The expression that computes it; None if it is independent."""
        return self.value.expression if isinstance(self.value, Computed) else None


def read_parameter(name: str, parameter: Parameter | float | str, length_unit: str) -> Parameter:
    """Return a parameter before it is computed, or raise a MechanismError for an invalid name or value."""
    check_name("[parameters]", name, most_parts=MOST_PARTS)
    if name in WORDS:
        raise MechanismError(f"[parameters] {name}: this name is reserved in expressions; reserved: {listed(WORDS)}")
    if not isinstance(parameter, Parameter):
        parameter = Parameter(parameter)  # type: ignore[arg-type]  # text until it is resolved
    check_line(f"[parameters] {name} description", parameter.description)
    value = read_number(f"[parameters] {name}", parameter.value, parameter.quantity, length_unit)
    quantity, unit = parameter.quantity, parameter.unit
    if isinstance(parameter.value, str | NumberWithUnit) and not isinstance(value, Expression):
        unit = given_unit(value)
        if quantity is None and unit:
            quantity, _ = every_unit(length_unit)[unit]
    return Parameter(value, quantity, parameter.description, unit)  # type: ignore[arg-type]  # computed later


def resolve_parameters(parameters: Mapping[str, Parameter], alone: Mapping[str, set[Quantity]]) -> dict[str, Parameter]:
    """Return the parameters in the given order with their values and quantities.

    parameters: As `read_parameter` returns them, by name. alone: For a parameter the quantities of the places where its
    name, or its negative, is the whole expression. Raise a MechanismError for an unknown name, a parameter that needs
    itself, or a unit that does not fit.
    """
    expressions: dict[str, Any] = {name: p.value for name, p in parameters.items() if isinstance(p.value, Expression)}
    order = in_order(parameters, expressions)
    quantities = {name: parameter.quantity for name, parameter in parameters.items()}
    needed = {name: set(alone.get(name, ())) for name in parameters}
    for name in reversed(order):
        if quantities[name] is None and name not in expressions and len(needed[name]) == 1:
            (quantities[name],) = needed[name]
        other = expressions[name].alone_or_negative if name in expressions else None
        if other is not None:
            needed[other] |= needed[name]
    done: dict[str, Parameter] = {}
    values: dict[str, float] = {}
    dimensions: dict[str, Dimension] = {}
    for name in order:
        parameter, quantity = parameters[name], quantities[name]
        dimensions[name] = Dimension.of(quantity) if quantity and quantity != NUMBER else UNKNOWN
        if name in expressions:
            where, expression = f"[parameters] {name}", expressions[name]
            result = dimension_of(where, expression, dimensions, dimensions[name])
            if result.is_known and not result.is_open:
                dimensions[name] = result
                same = {one for one in needed[name] if result.mass and Dimension.of(one).powers == result.powers}
                quantity = quantity or (same.pop() if len(same) == 1 else result.quantity)  # torque, or its stiffness
            elif quantity is None and len(needed[name]) == 1:
                (quantity,) = needed[name]
                dimensions[name] = Dimension.of(quantity)
            expression = converted(where, expression, quantities, dimensions, quantity)
            done[name] = Parameter(compute(where, expression, values), quantity or NUMBER, parameter.description)
        else:
            done[name] = Parameter(parameter.value, quantity or NUMBER, parameter.description, parameter.unit)
        quantities[name] = done[name].quantity
        values[name] = float(done[name].value)
    return {name: done[name] for name in parameters}


def dimension_of(
    where: str, expression: Expression, dimensions: Mapping[str, Dimension], needed: Dimension
) -> Dimension:
    """Return the dimension of an expression, or raise a MechanismError; `where` is its key in messages."""
    try:
        found = expression.dimension(dimensions)
    except MechanismError as error:
        raise MechanismError(f"{where} = {error}") from None
    if not found.fits(needed):
        raise MechanismError(f"{where} = {quoted(expression.text)} is {found} and must be {needed}")
    return found


def compute(where: str, expression: Expression, values: Mapping[str, float]) -> Computed:
    """Return the number of an expression, or raise a MechanismError; `where` is its key in messages."""
    try:
        number = float(expression.value(values))
    except MechanismError as error:
        raise MechanismError(f"{where} = {error}") from None
    check_number(f"{where} = {quoted(expression.text)}", number)
    return Computed(number, expression)


def dimensions_of(parameters: Mapping[str, Parameter]) -> dict[str, Dimension]:
    """Return the dimensions of resolved parameters; those of pure numbers are unknown unless computed."""
    dimensions: dict[str, Dimension] = {}
    expressions = {name: p.expression for name, p in parameters.items() if p.expression is not None}
    for name in in_order(parameters, expressions):
        quantity = parameters[name].quantity
        if quantity is not None and quantity != NUMBER:
            dimensions[name] = Dimension.of(quantity)
        else:
            dimensions[name] = expressions[name].dimension(dimensions) if name in expressions else UNKNOWN
    return dimensions


def parameter_values(parameters: Mapping[str, Parameter], values: Mapping[str, Value]) -> dict[str, Value]:
    """Return the values of all parameters, in any arithmetic: those in `values`, and those computed from them."""
    expressions = {name: p.expression for name, p in parameters.items() if p.expression and name not in values}
    results: dict[str, Value] = {}
    for name in in_order(parameters, expressions):
        if name in values:
            results[name] = values[name]
        else:
            results[name] = expressions[name].value(results) if name in expressions else float(parameters[name].value)
    return results


def parameters_behind(parameters: Mapping[str, Parameter], *expressions: Expression) -> set[str]:
    """Return the parameters on which expressions depend, directly or through other parameters."""
    names, seen = [name for expression in expressions for name in expression.names], set[str]()
    while names:
        name = names.pop()
        if name not in seen:
            seen.add(name)
            other = parameters[name].expression
            names += other.names if other else ()
    return seen


def in_order(names: Iterable[str], expressions: Mapping[str, Expression]) -> list[str]:
    """Return the names sorted so that each comes after those in its expression."""
    names = dict.fromkeys(names)
    for name, expression in expressions.items():
        try:
            expression.refuse_unknown(names)
        except MechanismError as error:
            raise MechanismError(f"[parameters] {name} = {error}") from None
    needs = {name: expressions[name].names if name in expressions else () for name in names}
    try:
        return list(TopologicalSorter(needs).static_order())
    except CycleError as error:
        circle = error.args[1][::-1]
        shown = circle if len(circle) <= _MOST_LISTED else [*circle[: _MOST_LISTED - 1], "...", circle[-1]]
        raise MechanismError(f"[parameters] {circle[0]} needs itself: {' -> '.join(shown)}") from None


Converted = tuple[Dimension, list[ExpressionStep]]  # of a part of an expression


def converted(
    where: str,
    expression: Expression,
    quantities: Mapping[str, Quantity | None],
    dimensions: Mapping[str, Dimension],
    wanted: Quantity | None,
) -> Expression:
    """Return the expression with steps that convert its operands and its result; itself if there is nothing to do.

    Args:
        where: The key in messages.
        expression: As written.
        quantities: Quantities of the parameters.
        dimensions: Dimensions of the parameters.
        wanted: The quantity of the result.

    Raises:
        MechanismError: The result has a mass in it and no operand has a unit, so that its unit is unknown.

    """
    metre = METRES[expression.length_unit]
    found = expression.dimension(dimensions)
    result = 0 if wanted is None or found.is_open else length_power(wanted)
    name = expression.alone
    if metre == 1.0 or (name and result == _power(quantities.get(name))):
        return expression
    if result and wanted and not found.is_known and not _has_a_unit(expression, dimensions):
        raise MechanismError(
            f"{where} = {quoted(expression.text)} has no unit, and the file is in {expression.length_unit}: "
            f"give a number or a parameter ({listed(expression.names)}) its unit, such as '1 {KINDS[wanted.kind].unit}'"
        )
    units = every_unit(expression.length_unit)

    def leaf(step: ExpressionStep) -> Converted:
        if step.operation == "number":
            dimension, quantity = step.dimension, units[step.unit][0] if step.unit else None
        else:
            dimension, quantity = dimensions.get(step.value, UNKNOWN), quantities.get(step.value)
        return dimension, [step, *_times(metre, -_power(quantity), step.at)]

    def apply(step: ExpressionStep, operands: Sequence[Converted]) -> Converted:
        if step.operation in ("+", "-"):
            for (dimension, part), (other, _) in zip(operands, reversed(operands), strict=True):
                power = int(other.length) if dimension.is_open and other.is_known and other.mass else 0
                part += _times(metre, -power, step.at)  # a number without a unit is in N, like the other term
        dimension = OPERATIONS[step.operation].dimension(*(one for one, _ in operands), *step.exponent)
        return dimension, [*chain(*(part for _, part in operands)), step]

    _, own_steps = expression.evaluated(leaf, apply)
    steps = [*own_steps, *_times(metre, result, len(expression.text))]
    if len(steps) == len(expression.steps):
        return expression
    return replace(expression, steps=tuple(steps), is_converted=True)


def _power(quantity: Quantity | None) -> int:
    return 0 if quantity is None else length_power(quantity)


def _times(metre: float, power: int, at: int) -> tuple[ExpressionStep, ...]:
    """Return the steps that multiply by a power of the unit of length [m]."""
    factor = metre**power if power >= 0 else 1.0 / metre**-power
    return (ExpressionStep("number", at, factor), ExpressionStep("*", at)) if power else ()


def _has_a_unit(expression: Expression, dimensions: Mapping[str, Dimension]) -> bool:
    """Return True if the dimension of a number or a parameter in the expression is known."""
    known = [step.dimension for step in expression.steps if step.operation == "number"]
    known += [dimensions[name] for name in expression.names]
    return any(one.is_known and not one.is_open for one in known)


class Resolved(NamedTuple):
    """Members with numbers only, parameters with their values, and the expressions by their paths."""

    members: Members
    parameters: dict[str, Parameter]
    expressions: dict[NumberPath, Expression]


def resolve(members: Members, given: Mapping[str, Parameter], unit: str) -> Resolved:
    """Replace texts with units and expressions by numbers, and list the expressions.

    Raise a MechanismError if a value is not a number, a name is not a parameter, or a quantity does not fit its key.

    members: Bodies, joints, drivers, run, measures, gravity and loads as written. given: Parameters as written. unit:
    Unit of length.
    """
    if len(given) > MOST_PARAMETERS:
        raise MechanismError(f"[parameters] holds {len(given)} parameters; {MOST_PARAMETERS} at most")
    read = {name: read_parameter(name, parameter, unit) for name, parameter in given.items()}
    expressions: dict[NumberPath, Expression] = {}
    alone: dict[str, set[Quantity]] = {}

    def as_written(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        number = read_number(path_text(place), value, quantity, unit)
        if isinstance(number, Expression):
            expressions[place] = number
            if number.alone_or_negative:
                alone.setdefault(number.alone_or_negative, set()).add(quantity)
        return number

    members = members.changed(as_written)
    parameters = resolve_parameters(read, alone)
    values = {name: float(parameter.value) for name, parameter in parameters.items()}
    dimensions = dimensions_of(parameters)
    quantities = {name: parameter.quantity for name, parameter in parameters.items()}

    def computed(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        if not isinstance(value, Expression):
            return value
        where = path_text(place)
        try:
            value.refuse_unknown(values)
        except MechanismError as error:
            raise expression_error(where, value.text, quantity, unit, error) from None
        dimension_of(where, value, dimensions, Dimension.of(quantity))
        expressions[place] = converted(where, value, quantities, dimensions, quantity)
        return compute(where, expressions[place], values)

    return Resolved(members.changed(computed), parameters, expressions)
