"""Expressions with masses and forces: their numbers are in SI units, lengths in the mechanism's unit.

Inside an expression all numbers belong to one system of units: kilogram, the file's unit of length, second. So
"m*l**2/12" is right in a file in mm: the moment of inertia comes out in kg mm2, and the last step makes it kg m2. A
parameter such as "10 N" enters as 10000 kg mm/s2. In files in metres nothing is converted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import chain

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.dimension import UNKNOWN, Dimension
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.operations import OPERATIONS, ExpressionStep
from kinfmu.mechanism.valid import quoted
from kinfmu.units import KINDS, METRES, Quantity, every_unit, length_power


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
    stack: list[tuple[Dimension, list[ExpressionStep]]] = []
    for step in expression.steps:
        if step.operation == "number":
            power = _power(units[step.unit][0] if step.unit else None)
            stack.append((step.dimension, [step, *_times(metre, -power, step.at)]))
        elif step.operation == "name":
            power = _power(quantities.get(step.value))
            stack.append((dimensions.get(step.value, UNKNOWN), [step, *_times(metre, -power, step.at)]))
        else:
            operation = OPERATIONS[step.operation]
            first = len(stack) - operation.arity
            operands, exponent = [one for one, _ in stack[first:]], (step.value,) if step.operation == "power" else ()
            parts = [part for _, part in stack[first:]]
            if step.operation in ("+", "-"):
                for part, own, other in zip(parts, operands, reversed(operands), strict=True):
                    power = int(other.length) if own.is_open and other.is_known and other.mass else 0
                    part += _times(metre, -power, step.at)  # a number without a unit is in N, like the other term
            stack[first:] = [(operation.dimension(*operands, *exponent), [*chain(*parts), step])]
    steps = [*stack[0][1], *_times(metre, result, len(expression.text))]
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
