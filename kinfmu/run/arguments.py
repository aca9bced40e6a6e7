"""Arguments of a model: parameters and law constants, read as numbers for each call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.parameters import parameter_values
from kinfmu.mechanism.valid import LARGEST_NUMBER, is_number, quoted
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.trace import parameter_symbol
from kinfmu.solver.python.pose import Vector

Settings = Mapping[str, float | str]


class Setting(NamedTuple):
    """Parameters and law constants of one call.

    given: As the caller wrote them. values: Of all parameters of the plan; empty: those of the plan, none was given.
    constants: Of the laws of all drivers. load_constants: Of the laws of all loads.
    starts_elsewhere: The laws of drivers may start at another pose than the anchor's.
    """

    given: Settings
    values: Vector
    constants: Vector
    load_constants: Vector
    starts_elsewhere: bool


class Arguments:
    """The arguments of a plan: its parameters and the constants of its laws.

    Attributes:
        written: Values of the parameters as written.

    """

    def __init__(self, plan: SolvePlan) -> None:
        self.plan = plan
        self.mechanism = plan.mechanism
        self.written = tuple(parameter.value for parameter in plan.parameters)
        self._constants = constants = (*plan.law_constants, *plan.load_constants)
        self._constants_written = tuple(constant.value for constant in constants)
        self._places = {parameter.name: k for k, parameter in enumerate(plan.parameters)}
        self._constant_places = {constant.name: k for k, constant in enumerate(constants)}
        self.opens_expressions = any(plan.mechanism.parameters[name].expression for name in self._places)
        self._positive = {k for k, constant in enumerate(constants) if constant.is_positive}

    def setting(self, given: Settings) -> Setting:
        """Return parameters and law constants as numbers.

        Raise a RequestError if a name is unknown or a value is invalid, a MechanismError if the mechanism cannot have
        these values.
        """
        if not given:
            return Setting(given, (), *self._split(self._constants_written), starts_elsewhere=False)
        values, constants = list(self.written), list(self._constants_written)
        own = False
        for name, value in given.items():
            if not (type(value) is float or is_number(value)) or not abs(value) <= LARGEST_NUMBER:  # type: ignore[arg-type]
                return self.setting(self._read(given))._replace(given=given)
            place = self._places.get(name)
            if place is not None:
                values[place] = float(value)
                own = True
                continue
            place = self._constant_places.get(name)
            if place is None:
                raise self._unknown(name)
            constants[place] = float(value)
            if place in self._positive and not constants[place] > 0.0:
                self.mechanism.settable.number(name, value)  # refuses it
        if own and self.opens_expressions:  # those that are not given follow from the others
            known = {name: float(value) for name, value in given.items() if name in self._places}
            found = parameter_values(self.mechanism.parameters, known)
            values = [float(found[name]) for name in self._places]
        of_drivers, of_loads = self._split(tuple(constants))
        written = self._split(self._constants_written)[0]
        elsewhere = own or self._law_starts(of_drivers) != self._law_starts(written)
        return Setting(given, tuple(values) if own else (), of_drivers, of_loads, elsewhere)

    def _split(self, constants: Vector) -> tuple[Vector, Vector]:
        """Return the constants of the laws of drivers, and those of loads."""
        count = len(self.plan.law_constants)
        return constants[:count], constants[count:]

    def number(self, name: str, value: float | str) -> float:
        """Return the value of a parameter or law constant as a number.

        Raise a RequestError if the name is unknown, a MechanismError if the value is invalid.
        """
        setting = self.setting({name: value})
        if name in self._places:
            return setting.values[self._places[name]]
        return (*setting.constants, *setting.load_constants)[self._constant_places[name]]

    def _read(self, given: Settings) -> dict[str, float]:
        """Return the numbers of settings of which some are text, or refuse them."""
        for name in given:
            if name not in self._places and name not in self._constant_places:
                raise self._unknown(name)
        changed = self.mechanism.with_parameters(given)
        constants = changed.settable.constants
        return {
            name: float(changed.parameters[name].value) if name in self._places else constants[name].value
            for name in given
        }

    def _unknown(self, name: str) -> RequestError:
        parameter = self.mechanism.parameters.get(name)
        if parameter is not None:
            expression = parameter.expression
            how = f"follows from {quoted(expression.text)}" if expression else "is a number of the model"
            return RequestError(f"{name} {how}; compile(mechanism, parameters=['{name}']) makes it an argument")
        return self.mechanism.settable.unknown(name, [*self._places, *self._constant_places])

    def _law_starts(self, constants: Vector) -> Vector:
        """Return the driver values at which the laws start, with the parameters as written."""
        model = load_model(self.plan)
        u: Vector = model.drive(self.mechanism.run.start, constants)[0]
        return u

    def fixed(self, setting: Setting) -> Mapping[str, float]:
        """Return the coordinates that never move."""
        nodes = self.plan.fixed_nodes
        if not setting.values or all(node.constant is not None for node in nodes.values()):
            return self.plan.fixed
        known: dict[str, float] = {
            parameter_symbol(name): value for name, value in zip(self._places, setting.values, strict=True)
        }
        return dict(zip(nodes, evaluate(list(nodes.values()), known), strict=True))

    def mechanism_with(self, setting: Setting) -> Mechanism | Callable[[], Mechanism]:
        """Return the mechanism with parameters and law constants as set, or a function that makes it when read."""
        mechanism, given = self.mechanism, dict(setting.given)
        return (lambda: mechanism.with_parameters(given)) if given else mechanism

    def info(self, setting: Setting, engine: str) -> dict[str, str]:
        mechanism = self.mechanism
        values: dict[str, Any] = {}
        if setting.values:
            values = parameter_values(mechanism.parameters, dict(zip(self._places, setting.values, strict=True)))
        return {
            "name": mechanism.name,
            "title": mechanism.title,
            "engine": engine,
            **{name: repr(float(values.get(name, p.value))) for name, p in mechanism.parameters.items()},
            **{
                constant.name: repr(value)
                for constant, value in zip(self._constants, (*setting.constants, *setting.load_constants), strict=True)
            },
        }
