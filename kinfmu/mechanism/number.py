"""Numbers as engineers write them: plain, with a unit, or as an expression of parameters."""

from __future__ import annotations

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.quoted import quoted
from kinfmu.mechanism.valid import check_number, is_number
from kinfmu.units import Quantity, every_unit, factors

_EXAMPLES = {"angle": "60 deg", "length": "25 mm", "time": "10 ms"}


def written(where: str, value: object, quantity: Quantity | None, length_unit: str) -> float | Expression:
    """A number in the units used inside, or the expression that gives it; a MechanismError says what would be valid.

    value: a number, text such as '60 deg' with a unit of that quantity (of any if it is None), text such as
    '2*a + 5 mm', or an Expression.
    """
    if isinstance(value, Computed):
        value = value.expression
    if isinstance(value, Expression):
        return value if value.length_unit == length_unit else Expression(value.text, length_unit)
    if isinstance(value, str):
        try:
            expression = Expression(value, length_unit)
        except MechanismError as error:
            raise MechanismError(f"{where} = {error}") from None
        literal = expression.literal
        if literal is None:
            return expression
        known = factors(quantity, length_unit) if quantity else every_unit(length_unit)
        if quantity and known and not literal.unit:
            raise MechanismError(f"{where} = {quoted(value)}: text needs a unit, one of {listed(known)}")
        if literal.unit and literal.unit not in known:
            valid = f"must be one of {listed(known)}" if known else "does not belong to a pure number"
            raise MechanismError(f"{where} = {quoted(value)}: unit '{literal.unit}' {valid}")
        check_number(where, literal.value, value)
        return float(literal.value)
    if not is_number(value):
        valid = f"a number or text such as '{_example(quantity)}'"
        raise MechanismError(f"{where} = {quoted(value)} must be {valid}")
    check_number(where, value)
    return float(value)  # type: ignore[arg-type]  # is_number said so


def _example(quantity: Quantity | None) -> str:
    if quantity is None or quantity.kind not in _EXAMPLES:
        return "2*a"
    return _EXAMPLES[quantity.kind] + ("", "/s", "/s2")[quantity.order]
