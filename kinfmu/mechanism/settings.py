"""Settings: values of parameters, law constants and the tolerance, checked the same way wherever they are set."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple, TypeVar

from kinfmu.errors import MechanismError, RequestError, listed, valid_names
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.loads.load import Following
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.number import (
    DisplayUnit,
    display_unit,
    given_unit,
    in_unit_of,
    read_constant,
    read_number,
    unit_advice,
    written_unit,
)
from kinfmu.mechanism.parameters import NUMBER, Parameter
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.units import Quantity, unit_of


class LawConstant(NamedTuple):
    """A constant of the law of a driver or a load, its owner, settable under its name `<owner>.<key>`."""

    owner: str
    key: str
    value: float
    quantity: Quantity
    is_positive: bool = False  # other values are refused

    @property
    def name(self) -> str:
        return f"{self.owner}.{self.key}"


def law_constants(owners: Sequence[Driver | Load], computed: Collection[NumberPath]) -> Iterator[LawConstant]:
    """Yield the constants of the laws of drivers or loads in file order, without those given by an expression.

    owners: Drivers or loads. Most loads have no law, and the effort of external ones is an input. computed: Places of
    the numbers that are given by expressions.
    """
    for owner in owners:
        if isinstance(owner, Driver) or (isinstance(owner, Following) and not owner.inputs()):
            table = "drivers" if isinstance(owner, Driver) else "loads"
            for key, (value, measured) in owner.law.constants().items():
                if (table, owner.name, "law", key) not in computed:
                    yield LawConstant(owner.name, key, value, measured.quantity(*owner.law_kinds), measured.is_positive)


Owner = TypeVar("Owner", bound=Driver | Load)


def with_law_constants(
    owners: Sequence[Owner], constants: Iterable[LawConstant], values: Mapping[str, Value]
) -> tuple[Owner, ...]:
    """Return drivers or loads with other values, by name and in any arithmetic, of some of their law constants."""
    numbers: dict[str, dict[tuple[str | int, ...], Value]] = {}
    for constant in constants:
        if constant.name in values:
            numbers.setdefault(constant.owner, {})[constant.key,] = values[constant.name]
    return tuple(
        replace(owner, law=owner.law.with_numbers(numbers[owner.name])) if owner.name in numbers else owner  # type: ignore[type-var,union-attr]
        for owner in owners
    )


class Settable:
    """The parameters and law constants of a mechanism by name, with the checks of their names and values.

    Attributes:
        parameters: All parameters.
        constants: The law constants that are not written as expressions.
        names: Names of both.

    Args:
        parameters: As above.
        constants: As above.
        expressions: Expressions by the places of their numbers.
        length_unit: Unit of length.
        others: Returns tables by '<member>.<key>' of the numbers of joints and loads that cannot be set by name.

    """

    def __init__(
        self,
        parameters: Mapping[str, Parameter],
        constants: Sequence[LawConstant],
        expressions: Mapping[NumberPath, Expression],
        length_unit: str,
        others: Callable[[], Mapping[str, str]],
    ) -> None:
        self.parameters = parameters
        self.constants = {constant.name: constant for constant in constants}
        self.names = (*parameters, *self.constants)
        self._expressions = expressions
        self._length_unit, self._others = length_unit, others

    def __getitem__(self, name: str) -> Parameter | LawConstant:
        """Return a parameter or a law constant by its name."""
        return self.constants.get(name) or self.parameters[name]

    def check_name(self, name: str) -> None:
        """Raise a RequestError for a name that is neither a parameter nor a law constant."""
        if name not in self.parameters and name not in self.constants:
            raise self.unknown(name, self.names)

    def unknown(self, name: str, known: Sequence[str]) -> RequestError:
        """Return the error for a name that cannot be set; known: the names that can."""
        expression = self._expression(name)
        if expression is not None:
            return RequestError(f"{name} follows from {quoted(expression.text)}; set the parameters in it")
        table = self._others().get(name)
        if table is not None:
            key = name.replace(".", "_")
            return RequestError(
                f"there is no parameter {quoted(name)}: it is a number of {table}; to set it, give it as {key} in "
                f'[parameters] and write "{key}" in its place; parameters: {listed(known)}'
            )
        return RequestError(f"there is no parameter {quoted(name)}{valid_names(name, known, 'parameters')}")

    def parameter(self, name: str, value: object) -> Parameter:
        """Return a parameter with another value: a number, text with a unit, or an expression of other parameters.

        Raises:
            RequestError: The value is no number, is too large or has a wrong unit.

        """
        old = self.parameters[name]
        quantity = None if old.kind == "number" else old.quantity  # without a unit the new value decides
        with _as_request():
            read_number(name, value, quantity, self._length_unit)
        return Parameter(value, quantity, old.description)  # type: ignore[arg-type]  # text is resolved later

    def number(self, name: str, value: object) -> float:
        """Return the value of a parameter or a law constant, a number or text with a unit, in the units used inside.

        Raises:
            RequestError: The value is no number, is too large, has a wrong unit, or is not positive and must be.

        """
        setting = self[name]
        with _as_request(), unit_advice(name, setting.value, self._length_unit):
            number = read_constant(name, value, setting.quantity or NUMBER, self._length_unit)
        if isinstance(setting, LawConstant) and setting.is_positive and not number > 0.0:
            raise RequestError(f"{name} = {quoted(value)} must be positive")
        return number

    def as_in_file(self, name: str, value: float) -> float:
        """Return a value of a parameter or law constant in the unit of the mechanism file, rounded there."""
        setting = self[name]
        return in_unit_of(setting.value, value, setting.quantity or NUMBER, self._length_unit)

    def note_on_bare(self, name: str, values: Iterable[object]) -> str:
        """Return a note if one of the values is bare and the file writes the setting in another unit; else ''."""
        setting = self[name] if name in self.names else None
        if setting is None or not setting.quantity:
            return ""
        unit, taken = _unit_in_file(setting), unit_of(setting.quantity, self._length_unit)
        bare = next((value for value in values if is_number(value) and value != 0), None)
        if unit in ("", taken) or bare is None:
            return ""
        return (
            f"{name} = {bare:.12g} is taken in {taken}; the mechanism file writes it in {unit}: "
            f"for these write '{bare:.12g} {unit}'"
        )

    def display_unit(self, name: str, values: Iterable[object] = ()) -> DisplayUnit:
        """Return the unit in which people read a parameter or law constant: that of the first value with a unit.

        values: Those that a user gave. Default: the unit of the mechanism file, or the unit used inside.
        """
        setting = self[name]
        unit = written_unit(values, self._length_unit) or _unit_in_file(setting)
        return display_unit(setting.quantity, self._length_unit, unit)

    def _expression(self, name: str) -> Expression | None:
        """Return the expression of a parameter or of a number of a body, joint, driver or load, if it has one."""
        if name in self.parameters:
            return self.parameters[name].expression
        tables = ("bodies", "drivers", "joints", "loads")
        paths = {_dotted(path): path for path in self._expressions if path[0] in tables}
        return self._expressions[paths[name]] if name in paths else None


def _dotted(path: NumberPath) -> str:
    """Return the name of a number: 'crank.P.x' of a point, 'crank.speed' of a law."""
    table, owner, *keys = path
    if table == "bodies":
        keys = ["xy"[key] if isinstance(key, int) else key for key in keys if key != "points"]
    return ".".join((str(owner), *(str(key) for key in keys if key != "law")))


def _unit_in_file(setting: Parameter | LawConstant) -> str:
    """Return the unit in which the mechanism file writes a parameter or law constant; '' if there is none."""
    return setting.unit if isinstance(setting, Parameter) else given_unit(setting.value)


@contextmanager
def _as_request() -> Iterator[None]:
    """Turn a MechanismError about a value into a RequestError: the value is not one of a file."""
    try:
        yield
    except MechanismError as error:
        raise RequestError(str(error)) from None


def read_tolerance(name: str, value: object) -> float:
    """Return a tolerance of the solver, or raise a RequestError unless it is a positive number."""
    if type(value) is float and 0.0 < value < math.inf:
        return value
    if not (is_number(value) and 0.0 < value < math.inf):  # type: ignore[operator]  # it is a number
        raise RequestError(f"{name} = {quoted(value)} must be a positive number")
    return float(value)  # type: ignore[arg-type]
