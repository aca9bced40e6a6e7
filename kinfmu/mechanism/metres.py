"""A mechanism in metres: the same lengths, and expressions that give the same lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from decimal import Decimal
from typing import Any

from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.members import Members, NumberPath
from kinfmu.mechanism.operations import NUMBER, OPERATIONS, Dimension, DimensionError, ExpressionStep
from kinfmu.mechanism.parameters import NUMBER as PURE
from kinfmu.mechanism.parameters import Parameter, dimensions_of
from kinfmu.units import METRES, Quantity, every_unit, length_power

_SUM, _PRODUCT, _POWER, _ATOM = range(4)  # precedence of a text
Part = tuple[str, int]  # text of a part of an expression, and its precedence
_PRECEDENCE = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT}


def in_metres(old: str, declared: Mapping[str, Parameter], members: Members) -> dict[str, Any]:
    """Return the fields of a mechanism with the metre as its unit of length that differ from those in unit `old`.

    Numbers are multiplied in decimal, so that 57.3 mm is 0.0573 m. An expression whose terms all have units stays as it
    is. In another one, such as "2*a + 5", bare numbers are in the old unit, and so is everything then:
    "(2.0*(a/(1 mm)) + 5.0)*(1 mm)".
    """
    metre, dimensions = Decimal(repr(METRES[old])), dimensions_of(declared)

    def number(value: float, quantity: Quantity) -> float:
        power = _power(quantity)
        return float(Decimal(repr(float(value))) * metre**power) if power else value

    def text(expression: Expression, quantity: Quantity, needed: Dimension) -> Expression:
        return Expression(_text(Expression(expression.text, old), dimensions, needed, _power(quantity)))

    def changed(_: NumberPath, value: Any, quantity: Quantity) -> Any:
        if isinstance(value, Computed):
            return text(value.expression, quantity, Dimension.of(quantity))
        return number(value, quantity) if isinstance(value, float | int) else value

    parameters: dict[str, Parameter] = {}
    for name, one in declared.items():
        quantity, value = one.quantity or PURE, one.value
        if one.expression is None:
            value = number(value, quantity)
        else:
            needed = dimensions[name] if quantity == PURE else Dimension.of(quantity)
            value = text(one.expression, quantity, needed)  # type: ignore[assignment]  # until it is resolved
        parameters[name] = Parameter(value, None if quantity == PURE else quantity, one.description)
    metric = members.changed(changed)
    parts = {key.name: getattr(metric, key.name) for key in fields(Members)}
    return {"length_unit": "m", "parameters": parameters, **parts}


def _power(quantity: Quantity) -> int:
    """Return the power of the unit of length in numbers of a quantity; those with a mass are in SI units."""
    return int(quantity.kind == "length") - (quantity.order if quantity.per == "length" else 0)


def _text(expression: Expression, dimensions: Mapping[str, Dimension], needed: Dimension, bare: int) -> str:
    """Return the text of an expression that gives in metres what it gives in its unit of length.

    dimensions: Dimensions of the parameters. needed: Dimension of the result. bare: Power of the unit of length in a
    result without a unit.
    """
    if expression.alone or _terms_have_units(expression, dimensions, needed):
        return expression.text
    unit, units = expression.length_unit, every_unit(expression.length_unit)

    def leaf(step: ExpressionStep) -> Part:
        if step.operation == "number":
            power = length_power(units[step.unit][0]) if step.unit else 0
            return repr(float(Decimal(repr(step.value)) * Decimal(repr(METRES[unit])) ** -power)), _ATOM
        known = dimensions[step.value]
        over = _power_text(unit, int(known.length) if known.is_known and not known.is_open else 0)
        return (f"({step.value}/{over})" if over else step.value), _ATOM

    whole = expression.evaluated(leaf, _applied)
    found = expression.dimension(dimensions)
    times = _power_text(unit, bare if found.is_open else int(needed.length))
    return f"{_inside(whole, _PRODUCT)}*{times}" if times else whole[0]


def _applied(step: ExpressionStep, operands: Sequence[Part]) -> Part:
    """Return the text of an operation on texts."""
    if step.operation in _PRECEDENCE:
        own = _PRECEDENCE[step.operation]
        left, right = _inside(operands[0], own), _inside(operands[1], own + 1)
        return (f"{left} {step.operation} {right}" if own == _SUM else f"{left}{step.operation}{right}"), own
    if step.operation == "power":
        return f"{_inside(operands[0], _ATOM)}**{step.value}", _POWER
    if step.operation == "sign":
        return f"(-{_inside(operands[0], _POWER)})", _ATOM
    arguments = ", ".join(text for text, _ in operands)
    return (f"{step.operation}({arguments})" if operands else step.operation), _ATOM


def _inside(operand: Part, least: int) -> str:
    text, precedence = operand
    return text if precedence >= least else f"({text})"


def _power_text(unit: str, power: int) -> str:
    """Return '(1 mm)', '(1 mm)**2', or '' for the power 0."""
    return "" if power == 0 else f"(1 {unit})" if power == 1 else f"(1 {unit})**{power}"


def _terms_have_units(expression: Expression, dimensions: Mapping[str, Dimension], needed: Dimension) -> bool:
    """Return True if all dimensions are compatible although numbers without a unit have none."""

    def leaf(step: ExpressionStep) -> Dimension:
        known = step.dimension if step.operation == "number" else dimensions[step.value]
        return known if known.is_known else NUMBER

    def apply(step: ExpressionStep, operands: Sequence[Dimension]) -> Dimension:
        is_sum, has_mass = step.operation in ("+", "-"), any(one.mass for one in operands)
        if not (is_sum and (has_mass or all(one.is_open for one in operands))):  # such a number is in N in every file
            operands = [replace(one, is_bare=False) if one.is_open else one for one in operands]
        return OPERATIONS[step.operation].dimension(*operands, *step.exponent)

    try:
        return expression.evaluated(leaf, apply).powers == needed.powers
    except DimensionError:
        return False
