"""Numbers as engineers write them: bare, with a unit, or as an expression of parameters; units that show them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import NamedTuple

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.operations import Dimension
from kinfmu.mechanism.valid import check_number, is_number, quoted
from kinfmu.units import Quantity, every_unit, factors, unit_of

_PLAIN = re.compile(r"\s*[+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?[ \t]*([^\W\d][^\s*+()-]*|\N{DEGREE SIGN})\s*")  # number, word
_NUMBER = r"[0-9.]+(?:[eE][+-]?[0-9]+)?"
_QUOTIENT = re.compile(  # of which the unit belongs to both numbers: '1/360 s'
    rf"\s*([+-]?{_NUMBER})\s*/\s*({_NUMBER})[ \t]*((?:[^\W\d]|\N{{DEGREE SIGN}})[^*+()-]*)"
)
_WORDS = re.compile(r"\s*+[+-]?\s*+[^\W\d]\w*+(?:[\s-]++\w++)*+\s*+")  # 'y', '-x', 'Y axis', 'x-axis'
EXAMPLES = {
    "angle": "60 deg",
    "length": "25 mm",
    "time": "10 ms",
    "mass": "1.2 kg",
    "density": "7850 kg/m3",
    "areal_density": "39 kg/m2",
    "inertia": "0.003 kg m2",
    "force": "10 N",
    "torque": "2 N m",
    "stiffness": "200 N/m",
    "torsional_stiffness": "5 N m/rad",
    "damping": "20 N s/m",
    "torsional_damping": "0.1 N m s/rad",
}


class NumberWithUnit(float):
    """A float with the text that gave it, such as '60 deg', and the unit in it."""

    __slots__ = ("text", "unit")

    text: str
    unit: str

    def __new__(cls, value: float, text: str, unit: str) -> NumberWithUnit:
        number = super().__new__(cls, value)
        number.text, number.unit = text, unit
        return number

    def __getnewargs__(self) -> tuple[float, str, str]:  # type: ignore[override]  # for copies
        return float(self), self.text, self.unit


def read_number(where: str, value: object, quantity: Quantity | None, length_unit: str) -> float | Expression:
    """Return a number in the units used inside, or the expression that gives it.

    Args:
        where: The key in messages, such as '[joints.AB] length'.
        value: A number, text such as '60 deg' or '2*a + 5 mm', or an Expression.
        quantity: The quantity that the key needs; None: any.
        length_unit: Unit of length of the mechanism.

    Raises:
        MechanismError: The value is not a number or has a wrong unit; the message states what would be valid.

    """
    if isinstance(value, Computed):
        value = value.expression
    if isinstance(value, Expression):
        is_as_written = value.length_unit == length_unit and not value.is_converted
        return value if is_as_written else Expression(value.text, length_unit)
    if isinstance(value, str):
        units = factors(quantity, length_unit) if quantity else every_unit(length_unit)
        try:
            expression = _expression(value, length_unit)
        except MechanismError as error:
            plain = _PLAIN.fullmatch(value)
            if plain and quantity and units:  # a number with a wrong unit, not an expression
                raise _wrong_unit(where, value, plain[1], units) from None
            raise expression_error(where, value, quantity, length_unit, error) from None
        literal = expression.literal
        if literal is None:
            return expression
        if quantity and units and not literal.unit:
            raise MechanismError(f"{where} = {quoted(value)}: text needs a unit, one of {listed(units)}")
        if literal.unit and literal.unit not in units:
            raise _wrong_unit(where, value, literal.unit, units)
        number = float(literal.value)
        if literal.unit and quantity:
            factor, (_, usual) = factors(quantity, length_unit)[literal.unit], every_unit(length_unit)[literal.unit]
            number = number if factor == usual else number * (factor / usual)  # the unit of two quantities
        check_number(where, number, value)
        return NumberWithUnit(number, value, literal.unit) if literal.unit else number
    if not is_number(value):
        valid = f"a number or text such as '{_example(quantity, length_unit)}'"
        raise MechanismError(f"{where} = {quoted(value)} must be {valid}")
    check_number(where, value)
    return value if isinstance(value, NumberWithUnit) else float(value)  # type: ignore[arg-type]  # is_number has checked it


def _expression(text: str, length_unit: str) -> Expression:
    """Return an expression; of a quotient of two numbers with a unit, such as '1/360 s', one number."""
    quotient = _QUOTIENT.fullmatch(text)
    if quotient:
        above, below, unit = quotient.groups()
        with suppress(ValueError, ZeroDivisionError, MechanismError):
            return Expression(f"{float(above) / float(below)!r} {unit}", length_unit)
    return Expression(text, length_unit)


def given_unit(value: object) -> str:
    """Return the unit in which a number was written; '' if there is none."""
    return str(value.unit) if isinstance(value, NumberWithUnit) else ""


def in_unit_of(old: object, value: float, quantity: Quantity, length_unit: str) -> float:
    """Return a number in the unit of another one, rounded there to 15 digits; itself if that one has no unit."""
    unit = given_unit(old)
    factor = factors(quantity, length_unit).get(unit)
    if factor is None:
        return value
    shown = float(value) / factor
    rounded = float(f"{shown:.15g}")  # 60.0, not 59.99999999999999
    return read_constant("", f"{rounded!r} {unit}", quantity, length_unit)


def read_constant(where: str, value: object, quantity: Quantity, length_unit: str) -> float:
    """Return a number, or the number of text such as '30 rpm', in the units used inside.

    Raise a MechanismError if it is not a number, has a wrong unit or is an expression.
    """
    if isinstance(value, str):
        number = read_number(where, value, quantity, length_unit)
        if isinstance(number, Expression):
            known = factors(quantity, length_unit)
            valid = f"a number, alone or with a unit: {listed(known)}" if known else "a number"
            raise MechanismError(f"{where} = {quoted(value)} must be {valid}")
        return number
    check_number(where, value)
    return value if isinstance(value, NumberWithUnit) else float(value)  # type: ignore[arg-type]  # check_number has checked it


def expression_error(
    where: str, text: str, quantity: Quantity | None, length_unit: str, error: MechanismError
) -> MechanismError:
    """Add the key to an error about an expression; if the text is only words, state the needed quantity too."""
    if quantity is None or not _WORDS.fullmatch(text):
        return MechanismError(f"{where} = {error}")
    needed, example = Dimension.of(quantity), _example(quantity, length_unit)
    return MechanismError(f"{where} must be {needed}, such as '{example}': {error}")


def _wrong_unit(where: str, value: str, unit: str, known: Collection[str]) -> MechanismError:
    near = suggestion(unit, known)
    valid = f"must be one of {listed(known)}{near}" if known else "does not belong to a pure number"
    return MechanismError(f"{where} = {quoted(value)}: unit {quoted(unit)} {valid}", unit=None if known else unit)


@contextmanager
def unit_advice(name: str, number: float, length_unit: str) -> Iterator[None]:
    """Complete the error about a unit of a value of a parameter that has none: where to write the unit.

    name: The parameter; of constants of laws nothing is added. number: Its value in the mechanism file. length_unit:
    Unit of length of the mechanism.
    """
    try:
        yield
    except MechanismError as error:
        unit = error.data.get("unit")
        if unit not in every_unit(length_unit) or "." in name:  # constants of laws have the quantity of their key
            raise
        usual = unit_of(every_unit(length_unit)[str(unit)][0], length_unit)
        raise MechanismError(
            f"{error}; {name} has no unit in the mechanism file: if it is no pure number, write there "
            f'{name} = "{number:.12g} {usual}"'
        ) from None


def _example(quantity: Quantity | None, length_unit: str) -> str:
    if quantity is None or not factors(quantity, length_unit):
        return "2*a"
    _, slash, per = unit_of(quantity, length_unit).rpartition("/") if quantity.order else ("", "", "")
    return EXAMPLES[quantity.kind] + slash + per


class DisplayUnit(NamedTuple):
    """A unit in which numbers are shown: shown number = number / factor."""

    unit: str = "1"
    factor: float = 1.0

    @property
    def suffix(self) -> str:
        """The unit after a number, ' deg'; '' of pure numbers."""
        return "" if self.unit == "1" else f" {self.unit}"


def display_unit(quantity: Quantity | None, length_unit: str, wanted: str = "") -> DisplayUnit:
    """Return a unit to show a quantity in.

    quantity: The quantity; None: a pure number. length_unit: Unit of length of the mechanism. wanted: The unit.
    Default, and for units of other quantities: the unit used inside.
    """
    if quantity is None or quantity.kind == "number":
        return DisplayUnit()
    known = factors(quantity, length_unit)
    unit = wanted if wanted in known else unit_of(quantity, length_unit)
    return DisplayUnit(unit, known.get(unit, 1.0))


def written_unit(values: Iterable[object], length_unit: str) -> str:
    """Return the unit of the first value that is text with a unit, such as '20 deg'; '' if none is."""
    for value in values:
        if isinstance(value, str):
            try:
                literal = Expression(value, length_unit).literal
            except MechanismError:
                continue
            if literal is not None and literal.unit:
                return literal.unit
    return ""
