"""Expression: arithmetic of parameters, such as "2*a + 5 mm", parsed to steps; Python never evaluates the text.

    sum     = ["+" | "-"] product { ("+" | "-") product }
    product = power { ("*" | "/") power }             each factor may have a sign
    power   = atom ["**" whole number]
    atom    = number [unit] | name | "pi" | function "(" sum { "," sum } ")" | "(" sum ")"

A word or a degree sign directly after a number is its unit, or several words, such as "N m"; around the slash of a
unit, such as "mm/s", are no blanks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeVar

from kinfmu.errors import MechanismError, listed, suggestion, valid_names
from kinfmu.mechanism.operations import (
    BARE,
    CONSTANTS,
    FUNCTIONS,
    OPERATIONS,
    UNKNOWN,
    WORDS,
    Dimension,
    DimensionError,
    ExpressionStep,
)
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.valid import quoted
from kinfmu.units import every_unit, spelled

LONGEST = 1000  # characters
DEEPEST = 40  # parentheses within parentheses
LARGEST_POWER = 20  # exponent; a polynomial of a higher degree loses its digits to rounding
_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*)|(?P<sign>\*\*|[-+*/(),])"
)
_WORD = r"(?:[A-Za-z_][A-Za-z0-9_]*|\N{DEGREE SIGN})"
_UNIT = re.compile(rf"[ \t]*({_WORD}((?: {_WORD}){{0,2}}))(/{_WORD})?")  # the longest has three words, 'N m s/rad'
_SIGNS_IN_UNIT = re.compile(r"[ \t]*([^\W\d][^+,()-]*)")
_PLAIN_SIGNS = str.maketrans(
    {"^": "", "\N{SUPERSCRIPT TWO}": "2", "\N{SUPERSCRIPT THREE}": "3", "\N{MIDDLE DOT}": " ", "\N{DOT OPERATOR}": " "}
)
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Expression:
    """An expression of parameters, parsed once.

    Two expressions are equal if text and unit are equal.

    Args:
        text: Such as "2*a + 5 mm".
        length_unit: Unit of length of the mechanism; lengths with other units are converted to it. Default: 'm'.
        steps: The operations in postfix order. Default: those that the text gives.
        is_converted: True if the steps convert between SI units and the unit of length (see `conversion`).

    Raises:
        MechanismError: The text is not an expression; the message states the position.

    """

    text: str
    length_unit: str = "m"
    steps: tuple[ExpressionStep, ...] = field(default=(), compare=False)
    is_converted: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", self.text.strip(" \t"))
        if not self.steps:
            object.__setattr__(self, "steps", _Parser(self.text, self.length_unit).parsed())

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    def __add__(self, shift: float) -> Expression:
        """Return the expression plus a length, such as a shift of the origin."""
        end = len(self.text)
        steps = (*self.steps, ExpressionStep("number", end, shift), ExpressionStep("+", end))
        return Expression(f"({self.text}) + {shift!r}", self.length_unit, steps)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The parameters in it, each once, in their order."""
        return tuple(dict.fromkeys(step.value for step in self.steps if step.operation == "name"))

    @property
    def alone(self) -> str | None:
        """The name of the parameter if it is the whole expression, else None."""
        return self.steps[0].value if len(self.steps) == 1 and self.names else None

    @property
    def alone_or_negative(self) -> str | None:
        """The name of the parameter if the expression is only it and its sign, else None."""
        first, *signs = self.steps
        return first.value if first.operation == "name" and all(one.operation == "sign" for one in signs) else None

    @property
    def literal(self) -> ExpressionStep | None:
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

        def leaf(step: ExpressionStep) -> Value:
            if step.operation == "number":
                return step.value
            if step.value not in values:
                raise self._unknown(step, values)
            return values[step.value]

        def apply(step: ExpressionStep, operands: Sequence[Value]) -> Value:
            try:
                result = OPERATIONS[step.operation].value(*operands, *step.exponent)
                if isinstance(result, float) and not math.isfinite(result):
                    raise OverflowError
            except ZeroDivisionError:
                raise error_at(self.text, step.at, "division by zero") from None
            except OverflowError:
                raise error_at(self.text, step.at, "the number is too large") from None
            except ValueError:
                what = f"{step.operation} of {quoted(operands[-1])} is undefined"
                raise error_at(self.text, step.at, what) from None
            return result

        return self.evaluated(leaf, apply)

    def dimension(self, dimensions: Mapping[str, Dimension]) -> Dimension:
        """Return the dimension of the expression, or raise a MechanismError where dimensions are incompatible."""

        def leaf(step: ExpressionStep) -> Dimension:
            return step.dimension if step.operation == "number" else dimensions.get(step.value, UNKNOWN)

        def apply(step: ExpressionStep, operands: Sequence[Dimension]) -> Dimension:
            try:
                return OPERATIONS[step.operation].dimension(*operands, *step.exponent)
            except DimensionError as error:
                raise error_at(self.text, step.at, f"'{step.operation}': {error}") from None

        return self.evaluated(leaf, apply)

    def evaluated(self, leaf: Callable[[ExpressionStep], T], apply: Callable[[ExpressionStep, Sequence[T]], T]) -> T:
        """Return the result of the steps: what `leaf` makes of numbers and names, and `apply` of operands."""
        stack: list[T] = []
        for step in self.steps:
            if step.operation in ("number", "name"):
                stack.append(leaf(step))
            else:
                first = len(stack) - OPERATIONS[step.operation].arity
                stack[first:] = [apply(step, stack[first:])]
        return stack[0]

    def refuse_unknown(self, names: Collection[str]) -> None:
        """Raise a MechanismError for the first name that is not among `names`."""
        for step in self.steps:
            if step.operation == "name" and step.value not in names:
                raise self._unknown(step, names)

    def _unknown(self, step: ExpressionStep, names: Iterable[str]) -> MechanismError:
        names = list(names)
        what = f"no parameter '{step.value}'{suggestion(step.value, [*names, *WORDS])}; parameters: {listed(names)}"
        return error_at(self.text, step.at, what)


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


def error_at(text: str, at: int, what: str) -> MechanismError:
    return MechanismError(f"{quoted(text)}, character {at + 1}: {what}")


class _Token(NamedTuple):
    kind: str  # "number", "name", "sign", "end"
    text: str
    at: int


class _Parser:
    """Parser from text to steps in postfix order, by recursive descent."""

    def __init__(self, text: str, length_unit: str) -> None:
        self._text = text
        self._units = every_unit(length_unit)
        self._steps: list[ExpressionStep] = []
        self._depth = 0
        self._at = 0
        self._token = _Token("end", "", 0)

    def parsed(self) -> tuple[ExpressionStep, ...]:
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
                raise error_at(self._text, self._at, "powers are written with **")

    def _is(self, *signs: str) -> bool:
        return self._token.kind == "sign" and self._token.text in signs

    def _sum(self) -> None:
        self._operands(("+", "-"), self._product)

    def _product(self) -> None:
        self._operands(("*", "/"), self._factor)

    def _operands(self, signs: tuple[str, ...], operand: Callable[[], None]) -> None:
        """Parse operands with these signs between them."""
        operand()
        while self._is(*signs):
            operator = self._token
            self._next()
            operand()
            self._steps.append(ExpressionStep(operator.text, operator.at))

    def _factor(self) -> None:
        signs = []
        while self._is("+", "-"):
            signs.append(self._token)
            self._next()
        self._atom()
        if self._is("**"):
            operator = self._token
            self._next()
            self._steps.append(ExpressionStep("power", operator.at, self._exponent()))
        self._steps.extend(ExpressionStep("sign", sign.at) for sign in signs if sign.text == "-")

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
            self._steps.append(ExpressionStep(token.text, token.at))
        elif token.kind == "name":
            self._next()
            if self._is("("):
                valid = valid_names(token.text, FUNCTIONS, "functions")
                raise error_at(self._text, token.at, f"no function '{token.text}'{valid}")
            is_constant = token.text in CONSTANTS
            self._steps.append(ExpressionStep(token.text if is_constant else "name", token.at, token.text))
        else:
            raise self._wrong("a number, a name or '('")

    def _number(self, token: _Token) -> None:
        """Parse a number and its unit, the longest known one."""
        value, unit, measures = float(token.text), "", BARE
        self._refuse_signs_in_unit()
        match = _UNIT.match(self._text, self._at)
        if match:
            begin, ends = match.start(1), [match.end(), match.end(1)]
            ends += [k for k in range(match.end(1) - 1, begin, -1) if self._text[k] == " "]
            end = next((end for end in ends if spelled(self._text[begin:end]) in self._units), ends[-1])
            unit = spelled(self._text[begin:end])
            if unit not in self._units:
                known = listed(u for u in self._units if not {"/", " "} & set(u))
                more = "and such as mm/s, rad/s2, N m"
                what = f"no unit '{unit}'{suggestion(unit, self._units)}; units: {known}, {more}"
                raise error_at(self._text, begin, f"{what}; a product needs *")
            quantity, factor = self._units[unit]
            value, measures, self._at = value * factor, Dimension.of(quantity), end
        if not math.isfinite(value):
            raise error_at(self._text, token.at, "the number is too large")
        self._steps.append(ExpressionStep("number", token.at, value, unit, measures))
        self._next()

    def _refuse_signs_in_unit(self) -> None:
        """Raise a MechanismError for a unit with signs that files write without, such as 'kg m^2'."""
        match = _SIGNS_IN_UNIT.match(self._text, self._at)
        written = match[1].rstrip() if match else ""
        plain = written.translate(_PLAIN_SIGNS)
        if " " in plain:  # 'kg m**2' is no square of 'kg m', but 'mm**2' is one of 'mm'
            plain = plain.replace("**", "")
        unit = spelled(plain)
        if match and plain != written and unit in self._units:
            raise error_at(self._text, match.start(1), f"no unit {quoted(written)}; did you mean '{unit}'?")

    def _inside(self, opening: _Token, count: int) -> None:
        """Parse parentheses with `count` sums, separated by commas."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise error_at(self._text, opening.at, f"parentheses more than {DEEPEST} deep")
        self._next()
        for k in range(count):
            self._sum()
            closing = "," if k < count - 1 else ")"
            if not self._is(closing):
                raise self._wrong(f"one of + - * / ** {closing}")
            self._next()
        self._depth -= 1

    def _wrong(self, valid: str) -> MechanismError:
        token = self._token
        read = {"end": "the end", "character": quoted(token.text)}.get(token.kind, f"'{token.text}'")
        near = suggestion(token.text, self._units) if token.kind == "character" else ""  # a degree or inch sign
        if re.fullmatch(r"\d,\d", self._text[max(0, token.at - 1) : token.at + 2]):
            near = "; a decimal has a point, not a comma"
        return error_at(self._text, token.at, f"expected {valid}, found {read}{near}")
