"""Arithmetic expressions of parameters, as mechanism files hold them: "2*a + 5 mm"."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.mechanism import dimension
from kinfmu.mechanism.dimension import Dimension, DimensionError
from kinfmu.mechanism.expression_text import error_at, steps_of
from kinfmu.mechanism.operations import OPERATIONS, WORDS, ExpressionStep
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.valid import quoted

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
            object.__setattr__(self, "steps", steps_of(self.text, self.length_unit))

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
                result = OPERATIONS[step.operation].value(*operands)
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

        return self._evaluated(leaf, apply)

    def dimension(self, dimensions: Mapping[str, Dimension]) -> Dimension:
        """Return the dimension of the expression, or raise a MechanismError where dimensions are incompatible."""

        def leaf(step: ExpressionStep) -> Dimension:
            return step.dimension if step.operation == "number" else dimensions.get(step.value, dimension.UNKNOWN)

        def apply(step: ExpressionStep, operands: Sequence[Any]) -> Dimension:
            try:
                return OPERATIONS[step.operation].dimension(*operands)
            except DimensionError as error:
                raise error_at(self.text, step.at, f"'{step.operation}': {error}") from None

        return self._evaluated(leaf, apply)

    def _evaluated(self, leaf: Callable[[ExpressionStep], T], apply: Callable[[ExpressionStep, Sequence[Any]], T]) -> T:
        """Return the result of the steps; `apply` gets the operands, and of a power also the exponent."""
        stack: list[T] = []
        for step in self.steps:
            if step.operation in ("number", "name"):
                stack.append(leaf(step))
            else:
                first = len(stack) - OPERATIONS[step.operation].arity
                exponent = (step.value,) if step.operation == "power" else ()
                stack[first:] = [apply(step, (*stack[first:], *exponent))]
        return stack[0]

    def refuse_unknown(self, names: Collection[str]) -> None:
        """Raise a MechanismError for the first name that is not among `names`."""
        for step in self.steps:
            if step.operation == "name" and step.value not in names:
                raise self._unknown(step, names)

    def _unknown(self, step: ExpressionStep, known: Iterable[str]) -> MechanismError:
        known = list(known)
        what = f"no parameter '{step.value}'{suggestion(step.value, [*known, *WORDS])}; parameters: {listed(known)}"
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
