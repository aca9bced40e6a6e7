"""Mechanism: the model that the engineer writes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import PurePath
from types import MappingProxyType
from typing import Any

from kinfmu.display import Live
from kinfmu.errors import RequestError
from kinfmu.mechanism.body import GROUND_NAME, Body, Gravity, RunSettings, read_gravity
from kinfmu.mechanism.checks import (
    check_header,
    check_members,
    check_names,
    check_outputs,
    check_readings,
    coordinate_orders,
)
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.members import MechanismParts, Members, NumberPath, texts_of
from kinfmu.mechanism.metres import in_metres
from kinfmu.mechanism.parameters import Parameter, parameter_values, parameters_behind, resolve
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.mechanism.settings import LawConstant, Settable, law_constants, with_law_constants
from kinfmu.units import OTHER_SPELLINGS, Quantity


@dataclass(frozen=True)
class Mechanism(MechanismParts, Live):
    """A planar mechanism: bodies, the joints between them, and the drivers that move it.

    Every number can also be given as text with a unit or as an expression of parameters ("60 deg", "a/2 + 5 mm"). The
    mechanism converts them to numbers; `expressions` lists the computed ones.

    Args:
        name: Name of the mechanism and of its FMU.
        bodies: The bodies; `ground` is added if it is missing.
        joints: The joints between them.
        drivers: One driver for each degree of freedom that the joints leave.
        points: Points of interest, name -> 'body.point'. Default: none.
        coordinates: The generalized coordinates in q: 'moving' (without those that a joint fixes to a constant), 'all',
            or names such as 'coupler.x' in the wanted order. Default: 'moving'.
        run: Start, stop and step of the intended run [s]. Default: 0, 1, 0.01.
        length_unit: Unit of all lengths. Default: 'm'.
        title: One line for people.
        parameters: Parameters by name, also as plain numbers or text ("40 mm", "2*a"). Default: none.
        measures: What `check` and `measure` read off a motion, such as a stroke. Default: none.
        gravity: Acceleration of free fall (x, y) [length/s2], such as (0, -9.81). Default: none.
        loads: Forces and torques on the bodies. Default: none.

    Attributes:
        expressions: The expressions of computed numbers, by path (see `NumberPath`).

    Raises:
        MechanismError: A name, reference or value is invalid; the message states table and key.

    """

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...] = ()
    drivers: tuple[Driver, ...] = ()
    points: Mapping[str, str] = field(default_factory=dict)
    coordinates: str | tuple[str, ...] = "moving"
    run: RunSettings = field(default_factory=RunSettings)
    length_unit: str = "m"
    title: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    measures: tuple[Reading, ...] = ()
    gravity: Gravity | None = None
    loads: tuple[Load, ...] = ()
    expressions: Mapping[NumberPath, Expression] = field(init=False)

    def __post_init__(self) -> None:
        for key in ("bodies", "joints", "drivers", "measures", "loads"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        if not isinstance(self.coordinates, str):
            object.__setattr__(self, "coordinates", tuple(self.coordinates))
        if not any(body.is_ground for body in self.bodies):
            object.__setattr__(self, "bodies", (Body(GROUND_NAME), *self.bodies))
        object.__setattr__(self, "points", MappingProxyType(dict(self.points)))
        object.__setattr__(self, "gravity", read_gravity(self.gravity))
        object.__setattr__(self, "length_unit", OTHER_SPELLINGS.get(self.length_unit, self.length_unit))
        check_header(self.name, self.title, self.length_unit)
        check_names(self.members, self.points)
        object.__setattr__(self, "loads", tuple(load.with_unit(self.length_unit) for load in self.loads))
        members, parameters, expressions = resolve(self.members, self.parameters, self.length_unit)
        for key in ("bodies", "joints", "drivers", "run", "measures", "gravity", "loads"):
            object.__setattr__(self, key, getattr(members, key))
        object.__setattr__(self, "parameters", MappingProxyType(parameters))
        object.__setattr__(self, "expressions", MappingProxyType(expressions))
        check_members(members, parameters, expressions, self.length_unit)
        check_outputs(members, self.points, self.coordinates)
        if self.measures:
            check_readings(members, coordinate_orders(self.coordinate_names, self.points))

    def __repr__(self) -> str:
        parts = {"moving bodies": self.moving_bodies, "joints": self.joints, "drivers": self.drivers}
        return f"<Mechanism {self.name}; {', '.join(f'{name}: {len(part)}' for name, part in parts.items())}>"

    def __hash__(self) -> int:
        members = (self.bodies, self.joints, self.drivers, self.gravity, self.loads)
        return hash((self.name, members, tuple(self.points.items()), self.coordinates))

    @cached_property
    def named_points(self) -> dict[str, tuple[float, float]]:
        """Those of `body_points` that a joint, driver, load, measure or point of interest names."""
        members = (*self.joints, *self.drivers, *self.loads, *self.measures)
        named = {*self.points.values()}.union(*map(texts_of, members))
        return {name: point for name, point in self.body_points.items() if name in named}

    @property
    def ground_points(self) -> list[tuple[float, float]]:
        """The places of those of `named_points` that are on the ground, in file order."""
        return [point for name, point in self.named_points.items() if body_of(name) == GROUND_NAME]

    @property
    def own_parameters(self) -> tuple[str, ...]:
        """Parameters written as numbers; the others follow from them by expressions."""
        return tuple(name for name, parameter in self.parameters.items() if parameter.expression is None)

    @property
    def unused_parameters(self) -> tuple[str, ...]:
        """Parameters to which no number of the mechanism refers, directly or through other parameters."""
        used = parameters_behind(self.parameters, *self.expressions.values())
        return tuple(name for name in self.parameters if name not in used)

    @property
    def members(self) -> Members:
        """Bodies, joints, drivers, run, measures, gravity and loads, with their numbers."""
        return Members(self.bodies, self.joints, self.drivers, self.run, self.measures, self.gravity, self.loads)

    def with_expressions(self) -> Members:
        """Return the members with expressions as they were written, instead of their numbers."""
        return self.members.changed(lambda _, value, __: value.expression if isinstance(value, Computed) else value)

    def at(self, values: Mapping[str, Value]) -> Members:
        """Return the members for other values of parameters, unchecked (`with_parameters` checks).

        Bodies have their centre of mass and moment of inertia in place of a rod.

        Args:
            values: Values by name, in any arithmetic: floats, symbols, Taylor numbers. Other parameters are computed
                from them or keep their numbers.

        """
        known = parameter_values(self.parameters, values)

        def computed(place: NumberPath, value: Any, _: Quantity) -> Any:
            is_open = isinstance(value, Computed) and place[0] not in ("run", "measures")  # not of the geometry
            return value.expression.value(known) if is_open else value

        members = self.members.changed(computed)
        bodies = tuple(body.with_mass_properties(self.length_unit) for body in members.bodies)
        return replace(members, bodies=bodies)

    @property
    def law_constants(self) -> tuple[LawConstant, ...]:
        """Settable constants of the drivers' laws; constants given by expressions follow from parameters instead."""
        return tuple(law_constants(self.drivers, self.expressions))

    @property
    def load_constants(self) -> tuple[LawConstant, ...]:
        """Settable constants of the loads' laws, on which forces depend, and the motion where efforts drive."""
        return tuple(law_constants(self.loads, self.expressions))

    @property
    def settable(self) -> Settable:
        """What can be set by name, with the checks of names and values."""
        constants = (*self.law_constants, *self.load_constants)
        return Settable(self.parameters, constants, self.expressions, self.length_unit, lambda: self._other_numbers)

    @property
    def _other_numbers(self) -> dict[str, str]:
        """Tables of the numbers of joints and loads that cannot be set by name, by '<member>.<key>'."""
        tables: dict[str, str] = {}
        for place, *_ in self.members.numbers():
            if place[0] in ("joints", "loads"):
                keys = (key for key in place[2:] if isinstance(key, str) and key != "law")
                tables[".".join((str(place[1]), *keys))] = f"[{place[0]}.{place[1]}]"
        return tables

    def with_parameters(self, values: Mapping[str, float | str]) -> Mechanism:
        """Return the mechanism with other values of some parameters.

        Args:
            values: Parameters by name, as numbers, text with a unit, or expressions; constants of laws by names such as
                "crank.speed", as numbers or text with a unit.

        Raises:
            RequestError: A name is neither a parameter nor a constant of a law, or a value is invalid.
            MechanismError: The mechanism cannot have these values.

        """
        settable, parameters = self.settable, dict(self.parameters)
        constants: dict[str, float] = {}
        for name, value in values.items():
            settable.check_name(name)
            if name in settable.constants:
                constants[name] = settable.number(name, value)
            else:
                parameters[name] = settable.parameter(name, value)
        drivers = with_law_constants(self.drivers, self.law_constants, constants)
        loads = with_law_constants(self.loads, self.load_constants, constants)
        return replace(self, parameters=parameters, drivers=drivers, loads=loads)

    def in_metres(self) -> Mechanism:
        """Return the mechanism with the metre as its unit of length; lengths and expressions stay the same lengths."""
        if self.length_unit == "m":
            return self
        return replace(self, **in_metres(self.length_unit, self.parameters, self.members))


def require_masses(mechanism: Mechanism) -> None:
    """Raise a RequestError if no body has a mass or an inertia, so that efforts determine no motion."""
    if not mechanism.has_masses:
        raise RequestError(
            f"mechanism '{mechanism.name}' has no masses, so that efforts do not determine its motion; "
            "give its bodies a mass or an inertia"
        )


def require_mechanism(value: object, purpose: str) -> None:
    """Raise a RequestError if a value is not a Mechanism, such as its name or path; purpose: 'solve'."""
    if isinstance(value, str | PurePath):
        raise RequestError(f"{purpose} needs a Mechanism: kinfmu.load({str(value)!r}) gives it")
    if not isinstance(value, Mechanism):
        raise RequestError(
            f"{purpose} needs a Mechanism, not {type(value).__name__}; kinfmu.load gives one by its name"
        )
