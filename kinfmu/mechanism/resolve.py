"""Conversion of texts with a unit and of expressions of parameters into numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.conversion import converted
from kinfmu.mechanism.dimension import Dimension
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.members import Members, NumberPath, path_text
from kinfmu.mechanism.number import expression_error, read_number
from kinfmu.mechanism.parameters import (
    Parameter,
    compute,
    dimension_of,
    dimensions_of,
    read_parameter,
    resolve_parameters,
)
from kinfmu.units import Quantity

MOST_PARAMETERS = 10_000


class Resolved(NamedTuple):
    """Members with numbers only, parameters with their values, and the expressions by their paths."""

    members: Members
    parameters: dict[str, Parameter]
    expressions: dict[NumberPath, Expression]


def resolve(members: Members, given: Mapping[str, Parameter], unit: str) -> Resolved:
    """Replace texts with units and expressions by numbers, and list the expressions.

    Args:
        members: Bodies, joints, drivers, run, measures, gravity and loads as written.
        given: Parameters as written.
        unit: Unit of length.

    Raises:
        MechanismError: A value is not a number, a name is not a parameter, or a quantity does not fit its key.

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
