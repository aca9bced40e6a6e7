"""Arithmetic expressions of parameters, as mechanism files hold them: "2*a + 5 mm".

    sum     = ["+" | "-"] product { ("+" | "-") product }
    product = power { ("*" | "/") power }             each factor may have a sign
    power   = atom ["**" whole number]
    atom    = number [unit] | name | "pi" | function "(" sum { "," sum } ")" | "(" sum ")"

A word directly after a number is its unit; a unit with a slash, such as "mm/s", contains no blanks. This module parses
the text; Python never evaluates it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.measures.arithmetic import Value, atan2, cos, sin, sqrt
from kinfmu.mechanism import dimension
from kinfmu.mechanism.dimension import Dimension, DimensionError
from kinfmu.mechanism.valid import quoted
from kinfmu.units import every_unit

LONGEST = 1000  # characters
DEEPEST = 40  # parentheses within parentheses
LARGEST_POWER = 20  # exponent; a polynomial of a higher degree loses its digits to rounding


class Step(NamedTuple):
    """One step of an expression in postfix order, and its position in the text."""

    operation: str  # "number", "name", "power", or a key of OPERATIONS
    at: int
    value: Any = None  # of "number" the float in the units used inside, of "name" the name, of "power" the exponent
    unit: str = ""  # of a number, as written
    dimension: Dimension = dimension.BARE  # of a number


class Operation(NamedTuple):
    """An operation in any arithmetic and on dimensions."""

    arity: int
    value: Callable[..., Value]
    dimension: Callable[..., Dimension]


def _tan(x: Value) -> Value:
    return sin(x) / cos(x)


def _asin(x: Value) -> Value:
    return atan2(x, sqrt((1.0 - x) * (1.0 + x)))


def _acos(x: Value) -> Value:
    return atan2(sqrt((1.0 - x) * (1.0 + x)), x)


OPERATORS = {
    "+": Operation(2, lambda a, b: a + b, dimension.sum_of),
    "-": Operation(2, lambda a, b: a - b, dimension.sum_of),
    "*": Operation(2, lambda a, b: a * b, dimension.product_of),
    "/": Operation(2, lambda a, b: a / b, dimension.quotient_of),
    "sign": Operation(1, lambda a: -a, lambda a: a),
}
CONSTANTS = {"pi": Operation(0, lambda: math.pi, lambda: dimension.BARE)}
FUNCTIONS = {
    "sin": Operation(1, sin, dimension.ratio_of_angle),
    "cos": Operation(1, cos, dimension.ratio_of_angle),
    "tan": Operation(1, _tan, dimension.ratio_of_angle),
    "sqrt": Operation(1, sqrt, lambda a: dimension.power_of(a, Fraction(1, 2))),
    "asin": Operation(1, _asin, dimension.angle_of_ratio),
    "acos": Operation(1, _acos, dimension.angle_of_ratio),
    "atan2": Operation(2, atan2, dimension.angle_of_pair),
}
OPERATIONS = {**OPERATORS, **CONSTANTS, **FUNCTIONS}
WORDS = (*FUNCTIONS, *CONSTANTS)  # reserved: no parameter can have these names


class Expression:
    """An expression of parameters, parsed once.

    Two expressions are equal if text and unit are equal.

    Args:
        text: Such as "2*a + 5 mm".
        length_unit: Unit of length of the mechanism; lengths with other units are converted to it. Default: 'm'.

    Attributes:
        names: The parameters in it, each once, in their order.
        steps: The operations in postfix order.

    Raises:
        MechanismError: The text is not an expression; the message states the position.

    """

    __slots__ = ("length_unit", "names", "steps", "text")

    text: str
    length_unit: str
    steps: tuple[Step, ...]
    names: tuple[str, ...]

    def __init__(self, text: str, length_unit: str = "m") -> None:
        self.text = text.strip(" \t")
        self.length_unit = length_unit
        self.steps = _Parser(self.text, length_unit).parsed()
        self.names = tuple(dict.fromkeys(step.value for step in self.steps if step.operation == "name"))

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Expression):
            return NotImplemented
        return (self.text, self.length_unit) == (other.text, other.length_unit)

    def __hash__(self) -> int:
        return hash((self.text, self.length_unit))

    def __add__(self, shift: float) -> Expression:
        """Return the expression plus a length, such as a shift of the origin."""
        moved = Expression.__new__(Expression)
        moved.text, moved.length_unit = f"({self.text}) + {shift!r}", self.length_unit
        end = len(self.text)
        moved.steps = (*self.steps, Step("number", end, shift), Step("+", end))
        moved.names = self.names
        return moved

    @property
    def alone(self) -> str | None:
        """The name of the parameter if it is the whole expression, else None."""
        return self.steps[0].value if len(self.steps) == 1 and self.names else None

    @property
    def literal(self) -> Step | None:
        """The number if the expression is only a number with its sign and unit, else None."""
        number, *signs = self.steps
        if number.operation != "number" or any(step.operation != "sign" for step in signs):
            return None
        return number._replace(value=-number.value if len(signs) % 2 else number.value)

    def value(self, values: Mapping[str, Value]) -> Value:
        """Return the value of the expression.

        Args:
            values: Values of the parameters by name, in any arithmetic: floats, symbols, Taylor numbers.

        Raises:
            MechanismError: A name without a value, a division by zero, a root of a negative number, or a number that
                is too large; the message states the position.

        """
        stack: list[Value] = []
        for step in self.steps:
            if step.operation == "number":
                stack.append(step.value)
            elif step.operation == "name":
                if step.value not in values:
                    raise self._unknown(step, values)
                stack.append(values[step.value])
            else:
                try:
                    self._apply(step, stack)
                except ZeroDivisionError:
                    raise self._wrong(step.at, "division by zero") from None
                except OverflowError:
                    raise self._wrong(step.at, "the number is too large") from None
                except ValueError:
                    what = f"{step.operation} of {quoted(stack[-1])} is undefined"
                    raise self._wrong(step.at, what) from None
        return stack[0]

    def _apply(self, step: Step, stack: list[Value]) -> None:
        if step.operation == "power":
            result = _power(stack[-1], step.value)
            arity = 1
        else:
            arity = OPERATIONS[step.operation].arity
            result = OPERATIONS[step.operation].value(*stack[len(stack) - arity :])
        if isinstance(result, float) and not math.isfinite(result):
            raise OverflowError
        stack[len(stack) - arity :] = [result]

    def dimension(self, dimensions: Mapping[str, Dimension]) -> Dimension:
        """Return the dimension of the expression, or raise a MechanismError where dimensions are incompatible."""
        stack: list[Dimension] = []
        for step in self.steps:
            if step.operation == "number":
                stack.append(step.dimension)
            elif step.operation == "name":
                stack.append(dimensions.get(step.value, dimension.UNKNOWN))
            elif step.operation == "power":
                stack[-1] = dimension.power_of(stack[-1], Fraction(step.value))
            else:
                first = len(stack) - OPERATIONS[step.operation].arity
                try:
                    stack[first:] = [OPERATIONS[step.operation].dimension(*stack[first:])]
                except DimensionError as error:
                    raise self._wrong(step.at, f"'{step.operation}': {error}") from None
        return stack[0]

    def refuse_unknown(self, names: Collection[str]) -> None:
        """Raise a MechanismError for the first name that is not among `names`."""
        for step in self.steps:
            if step.operation == "name" and step.value not in names:
                raise self._unknown(step, names)

    def _unknown(self, step: Step, known: Iterable[str]) -> MechanismError:
        known = list(known)
        what = f"no parameter '{step.value}'{suggestion(step.value, [*known, *WORDS])}; parameters: {listed(known)}"
        return self._wrong(step.at, what)

    def _wrong(self, at: int, what: str) -> MechanismError:
        return MechanismError(f"{quoted(self.text)}, character {at + 1}: {what}")


def _power(base: Value, exponent: int) -> Value:
    """Return base ** exponent, by products only, so that every arithmetic gives the same bits."""
    product = base
    for _ in range(abs(exponent) - 1):
        product = product * base
    return 1.0 if exponent == 0 else product if exponent > 0 else 1.0 / product


class _Token(NamedTuple):
    kind: str  # "number", "name", "sign", "end"
    text: str
    at: int


_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|[-+*/(),])"
)
_UNIT = re.compile(r"[ \t]*([A-Za-z_][A-Za-z0-9_]*)(/[A-Za-z_][A-Za-z0-9_]*)?")


class _Parser:
    """Parser from text to steps, by recursive descent."""

    def __init__(self, text: str, length_unit: str) -> None:
        self._text = text
        self._units = every_unit(length_unit)
        self._steps: list[Step] = []
        self._depth = 0
        self._at = 0
        self._token = _Token("end", "", 0)

    def parsed(self) -> tuple[Step, ...]:
        if len(self._text) > LONGEST:
            raise MechanismError(f"{quoted(self._text)} is too long for an expression; {LONGEST} characters at most")
        self._next()
        self._sum()
        if self._token.kind != "end":
            raise self._wrong("one of + - * / **")
        return tuple(self._steps)

    def _next(self) -> None:
        """Move on to the next token."""
        while self._text[self._at : self._at + 1] in (" ", "\t"):
            self._at += 1
        match = _TOKEN.match(self._text, self._at)
        if match:
            self._token = _Token(match.lastgroup or "", match[0], match.start())
            self._at = match.end()
        elif self._at == len(self._text):
            self._token = _Token("end", "", self._at)
        else:
            self._token = _Token("character", self._text[self._at], self._at)
            if self._token.text == "^":
                raise MechanismError(f"{quoted(self._text)}, character {self._at + 1}: powers are written with **")

    def _is(self, *signs: str) -> bool:
        return self._token.kind == "sign" and self._token.text in signs

    def _sum(self) -> None:
        self._product()
        while self._is("+", "-"):
            operator = self._token
            self._next()
            self._product()
            self._steps.append(Step(operator.text, operator.at))

    def _product(self) -> None:
        self._factor()
        while self._is("*", "/"):
            operator = self._token
            self._next()
            self._factor()
            self._steps.append(Step(operator.text, operator.at))

    def _factor(self) -> None:
        signs = []
        while self._is("+", "-"):
            signs.append(self._token)
            self._next()
        self._atom()
        if self._is("**"):
            operator = self._token
            self._next()
            self._steps.append(Step("power", operator.at, self._exponent()))
        self._steps.extend(Step("sign", sign.at) for sign in signs if sign.text == "-")

    def _exponent(self) -> int:
        sign = 1
        if self._is("+", "-"):
            sign = -1 if self._token.text == "-" else 1
            self._next()
        if self._token.kind != "number" or not self._token.text.isdigit():
            raise self._wrong("a whole number as exponent")
        if len(self._token.text) > 3 or int(self._token.text) > LARGEST_POWER:
            raise self._wrong(f"an exponent up to {LARGEST_POWER}")
        exponent = sign * int(self._token.text)
        self._next()
        if self._is("**"):
            raise self._wrong("parentheses around a power of a power")
        return exponent

    def _atom(self) -> None:
        token = self._token
        if token.kind == "number":
            self._number(token)
        elif self._is("("):
            self._inside(token, 1)
        elif token.kind == "name" and token.text in FUNCTIONS:
            self._next()
            if not self._is("("):
                raise self._wrong(f"'(' after {token.text}")
            self._inside(token, FUNCTIONS[token.text].arity)
            self._steps.append(Step(token.text, token.at))
        elif token.kind == "name":
            self._next()
            if self._is("("):
                near = suggestion(token.text, FUNCTIONS)
                raise MechanismError(
                    f"{quoted(self._text)}, character {token.at + 1}: no function '{token.text}'{near}; "
                    f"functions: {listed(FUNCTIONS)}"
                )
            is_constant = token.text in CONSTANTS
            self._steps.append(Step(token.text if is_constant else "name", token.at, token.text))
        else:
            raise self._wrong("a number, a name or '('")

    def _number(self, token: _Token) -> None:
        """Parse a number and its unit, the longest known one."""
        value, unit, measures = float(token.text), "", dimension.BARE
        match = _UNIT.match(self._text, self._at)
        if match:
            word, per = match[1], match[2] or ""
            unit, end = (word + per, match.end()) if word + per in self._units else (word, match.end(1))
            if unit not in self._units:
                near = suggestion(unit, self._units)
                raise MechanismError(
                    f"{quoted(self._text)}, character {match.start(1) + 1}: no unit '{unit}'{near}; "
                    f"units: {listed(u for u in self._units if '/' not in u)}, and such as mm/s, rad/s2; "
                    f"a product needs *"
                )
            quantity, factor = self._units[unit]
            value, measures, self._at = value * factor, Dimension.of(quantity), end
        if not math.isfinite(value):
            raise MechanismError(f"{quoted(self._text)}, character {token.at + 1}: the number is too large")
        self._steps.append(Step("number", token.at, value, unit, measures))
        self._next()

    def _inside(self, opening: _Token, count: int) -> None:
        """Parse parentheses with `count` sums, separated by commas."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise MechanismError(
                f"{quoted(self._text)}, character {opening.at + 1}: parentheses more than {DEEPEST} deep"
            )
        self._next()
        for k in range(count):
            self._sum()
            closing = "," if k < count - 1 else ")"
            if not self._is(closing):
                raise self._wrong(f"one of + - * / ** {closing}")
            self._next()
        self._depth -= 1

    def _wrong(self, valid: str) -> MechanismError:
        found = f"'{self._token.text}'" if self._token.kind != "end" else "the end"
        if self._token.kind == "character":
            found = quoted(self._token.text)
        return MechanismError(f"{quoted(self._text)}, character {self._token.at + 1}: expected {valid}, found {found}")


class Computed(float):
    """A float with the expression from which it was computed."""

    __slots__ = ("expression",)

    expression: Expression

    def __new__(cls, value: float, expression: Expression) -> Computed:
        number = super().__new__(cls, value)
        number.expression = expression
        return number

    def __getnewargs__(self) -> tuple[float, Expression]:  # type: ignore[override]  # for copies
        return float(self), self.expression
