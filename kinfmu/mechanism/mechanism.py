"""Mechanism: what the engineer writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

from kinfmu.drivers import Driver
from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.joints import Joint
from kinfmu.joints.arithmetic import Value
from kinfmu.joints.measures import Measure
from kinfmu.joints.placement import Reference, is_pair
from kinfmu.mechanism.body import GROUND_NAME, Body
from kinfmu.mechanism.dimension import Dimension
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.number import written
from kinfmu.mechanism.parameters import Parameter, dimensions_of, evaluated, read, resolved
from kinfmu.mechanism.places import Members, Place, hints_of, told
from kinfmu.mechanism.quoted import quoted
from kinfmu.mechanism.valid import check_line, check_name, check_number
from kinfmu.units import METRES, Quantity

MOST_BODIES = 20_000  # what an ordinary machine holds
MOST_PARAMETERS = 10_000
COORDINATES = ("x", "y", "phi")


@dataclass(frozen=True)
class RunSettings:
    """The run that a mechanism is meant for: from start to stop in communication steps, all [s]."""

    start: float = 0.0
    stop: float = 1.0
    step: float = 0.01

    def __post_init__(self) -> None:
        values = [getattr(self, key) for key in ("start", "stop", "step")]
        if any(isinstance(value, str | Expression) for value in values):
            return  # checked when the mechanism has resolved them
        for key, value in zip(("start", "stop", "step"), values, strict=True):
            check_number(f"[run] {key}", value)
        if self.step <= 0.0:
            raise MechanismError(f"[run] step = {self.step!r} must be positive")
        if self.stop < self.start:
            raise MechanismError(f"[run] stop = {self.stop!r} lies before start = {self.start!r}")


@dataclass(frozen=True)
class Mechanism:
    """A planar mechanism: bodies, the joints between them, and the drivers that move it.

    points: points of interest, name -> 'body.point'; coordinates: which generalized coordinates q holds: 'moving'
    (without those that a joint fixes to a constant), 'all', or names such as 'coupler.x' in the wanted order.
    parameters: numbers by name, which may be given as numbers or as text ("40 mm", "2*a") too. Wherever a number
    stands, text with a unit or an expression of parameters may stand instead ("60 deg", "a/2 + 5 mm"); once made, the
    mechanism holds the numbers there, and `expressions` says which of them are computed, by place.
    """

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...] = ()
    drivers: tuple[Driver, ...] = ()
    points: Mapping[str, str] = field(default_factory=dict)
    coordinates: str | tuple[str, ...] = "moving"
    run: RunSettings = RunSettings()
    length_unit: str = "m"
    title: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    expressions: Mapping[Place, Expression] = field(init=False)

    def __post_init__(self) -> None:
        for key in ("bodies", "joints", "drivers"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        if not isinstance(self.coordinates, str):
            object.__setattr__(self, "coordinates", tuple(self.coordinates))
        if not any(body.is_ground for body in self.bodies):
            object.__setattr__(self, "bodies", (Body(GROUND_NAME), *self.bodies))
        object.__setattr__(self, "points", MappingProxyType(dict(self.points)))
        _check_names_and_unit(self)
        _resolve(self)
        _check(self)

    def __hash__(self) -> int:
        return hash((self.name, self.bodies, self.joints, self.drivers, tuple(self.points.items()), self.coordinates))

    @property
    def moving_bodies(self) -> tuple[Body, ...]:
        """Bodies other than the ground, in file order."""
        return tuple(body for body in self.bodies if not body.is_ground)

    @property
    def body_points(self) -> dict[str, tuple[float, float]]:
        """Body-fixed coordinates of every point, by 'body.point'."""
        return {f"{body.name}.{name}": point for body in self.bodies for name, point in body.points.items()}

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """All generalized coordinates x, y, phi of the moving bodies, in file order."""
        return tuple(f"{body.name}.{c}" for body in self.moving_bodies for c in COORDINATES)

    @property
    def unused_parameters(self) -> tuple[str, ...]:
        """Parameters to which no number of the mechanism refers, not by way of others either."""
        open_ones = [name for expression in self.expressions.values() for name in expression.names]
        used: set[str] = set()
        while open_ones:
            name = open_ones.pop()
            if name not in used:
                used.add(name)
                expression = self.parameters[name].expression
                open_ones += expression.names if expression else ()
        return tuple(name for name in self.parameters if name not in used)

    @property
    def members(self) -> Members:
        """Bodies, joints, drivers and run, with their numbers."""
        return Members(self.bodies, self.joints, self.drivers, self.run)

    def written(self) -> Members:
        """The members with expressions in the places where they were written, instead of their numbers."""
        return self.members.changed(lambda _, value, __: value.expression if isinstance(value, Computed) else value)

    def at(self, values: Mapping[str, Value]) -> Members:
        """The members where parameters have these values, in any arithmetic: floats, symbols, Taylor numbers.

        Parameters that are not given are computed from those that are, or keep their numbers. Nothing is checked:
        `with_parameters` does that.
        """
        known = evaluated(self.parameters, values)

        def computed(place: Place, value: Any, _: Quantity) -> Any:
            is_open = isinstance(value, Computed) and place[0] != "run"  # the run does not move with the geometry
            return value.expression.value(known) if is_open else value

        return self.members.changed(computed)

    def with_parameters(self, values: Mapping[str, float | str]) -> Mechanism:
        """The mechanism with other values of some parameters: numbers, text with a unit, or expressions.

        Raises a MechanismError for a name that is no parameter and for values with which the mechanism cannot be meant.
        """
        parameters = dict(self.parameters)
        for name, value in values.items():
            if name not in parameters:
                near = suggestion(name, parameters)
                raise MechanismError(f"there is no parameter {quoted(name)}{near}; parameters: {listed(parameters)}")
            old = parameters[name]
            quantity = None if old.kind == "number" else old.quantity  # a pure number, or nobody could know
            parameters[name] = Parameter(value, quantity, old.description)  # type: ignore[arg-type]  # text is resolved
        return replace(self, parameters=parameters)


def _resolve(mechanism: Mechanism) -> None:
    """Put numbers in the place of texts with units and of expressions, and remember the expressions."""
    unit = mechanism.length_unit
    if len(mechanism.parameters) > MOST_PARAMETERS:
        raise MechanismError(f"[parameters] holds {len(mechanism.parameters)} parameters; {MOST_PARAMETERS} at most")
    said = {name: read(name, parameter, unit) for name, parameter in mechanism.parameters.items()}
    expressions: dict[Place, Expression] = {}
    alone: dict[str, set[Quantity]] = {}

    def as_written(place: Place, value: Any, quantity: Quantity) -> Any:
        number = written(told(place), value, quantity, unit)
        if isinstance(number, Expression):
            expressions[place] = number
            if number.alone:
                alone.setdefault(number.alone, set()).add(quantity)
        return number

    members = mechanism.members.changed(as_written)
    parameters = resolved(said, alone)
    values = {name: float(parameter.value) for name, parameter in parameters.items()}
    dimensions = dimensions_of(parameters)

    def computed(place: Place, value: Any, quantity: Quantity) -> Any:
        if not isinstance(value, Expression):
            return value
        try:
            found = value.dimension(dimensions)
            number = float(value.value(values))
        except MechanismError as error:
            raise MechanismError(f"{told(place)} = {error}") from None
        needed = Dimension.of(quantity)
        if not found.fits(needed):
            raise MechanismError(f"{told(place)} = {quoted(value.text)} is {found} and must be {needed}")
        check_number(f"{told(place)} = {quoted(value.text)}", number)
        return Computed(number, value)

    members = members.changed(computed)
    for key in ("bodies", "joints", "drivers", "run"):
        object.__setattr__(mechanism, key, getattr(members, key))
    object.__setattr__(mechanism, "parameters", MappingProxyType(parameters))
    object.__setattr__(mechanism, "expressions", MappingProxyType(expressions))


def _check_names_and_unit(mechanism: Mechanism) -> None:
    """Raise a MechanismError for a unit or a name that cannot be meant: places are found by names."""
    if mechanism.length_unit not in METRES:
        raise MechanismError(
            f"[units] length = {quoted(mechanism.length_unit)} is not a unit of length; known: {listed(METRES)}"
        )
    check_name("name =", mechanism.name)
    if len(mechanism.bodies) > MOST_BODIES:
        raise MechanismError(f"[bodies] holds {len(mechanism.bodies)} bodies; {MOST_BODIES} at most")
    check_line("title", mechanism.title)
    tables: dict[str, Iterable[Body | Joint | Driver]] = {
        "bodies": mechanism.bodies,
        "joints": mechanism.joints,
        "drivers": mechanism.drivers,
    }
    for table, members in tables.items():
        _check_names(table, [member.name for member in members])
    _check_names("points", mechanism.points)


Bodies = Mapping[str, Body]  # by name


def _check(mechanism: Mechanism) -> None:
    """Raise a MechanismError that names table and key for the first thing that cannot be meant."""
    if not mechanism.moving_bodies:
        raise MechanismError("[bodies] has only the ground; a mechanism needs a body that can move")
    for body in mechanism.bodies:
        _check_body_itself(body)
    bodies = {body.name: body for body in mechanism.bodies}
    constraining: tuple[Joint | Driver, ...] = (*mechanism.joints, *mechanism.drivers)
    for member in constraining:
        _check_references(bodies, member)
        _check_values(mechanism, member)
    for driver in mechanism.drivers:
        for name in driver.inputs():
            if name in mechanism.parameters:
                raise MechanismError(f"[parameters] {name}: driver '{driver.name}' has an input of this name already")
    for name, target in mechanism.points.items():
        _check_point(bodies, f"[points] {name}", target)
        if name in bodies:
            raise MechanismError(f"[points] {name}: a body has this name already, so '{name}.x' would mean two things")
    if isinstance(mechanism.coordinates, str):
        if mechanism.coordinates not in ("moving", "all"):
            raise MechanismError(
                f"[outputs] coordinates = {quoted(mechanism.coordinates)} must be 'moving', 'all' or a list of names"
            )
    else:
        known = dict.fromkeys(mechanism.coordinate_names)
        for name in mechanism.coordinates:
            if name not in known:
                raise MechanismError(
                    f"[outputs] coordinates: {quoted(name)} is no coordinate of this mechanism"
                    f"{suggestion(name, known)}; coordinates: {listed(known)}"
                )
        if len(set(mechanism.coordinates)) < len(mechanism.coordinates):
            raise MechanismError("[outputs] coordinates names a coordinate twice")


def _check_names(table: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        check_name(f"[{table}]", name)
        if name in seen:
            raise MechanismError(f"[{table}] '{name}' is there twice")
        seen.add(name)


def _check_body_itself(body: Body) -> None:
    for name in body.points:
        check_name(f"[bodies.{body.name}] points", name)
    if body.is_ground and any(value is not None for value in body.start):
        raise MechanismError("[bodies.ground] start: the ground does not move, its frame is the world's")


def _check_references(bodies: Bodies, member: Joint | Driver) -> None:
    table = "joints" if isinstance(member, Joint) else "drivers"
    _check_fields(bodies, f"[{table}.{member.name}] ", member)
    touched = member.bodies()
    if len(touched) > 1 and len(set(touched)) == 1:
        raise MechanismError(f"[{table}.{member.name}] joins body '{touched[0]}' to itself")
    if set(touched) == {GROUND_NAME}:
        raise MechanismError(f"[{table}.{member.name}] acts on the ground only, which does not move")


def _check_fields(bodies: Bodies, before: str, member: Joint | Driver | Measure) -> None:
    """What its fields refer to; `before` is said before the key."""
    cls: object = type(member)
    hints = hints_of(cls)
    for key in fields(member):  # type: ignore[arg-type]  # every leaf is a dataclass; the contract cannot say so
        where, value = f"{before}{key.name}", getattr(member, key.name)
        if isinstance(value, Measure):
            _check_fields(bodies, f"{where}.", value)
        for said in getattr(hints[key.name], "__metadata__", ()):
            if isinstance(said, Reference) and not (value is None and key.default is None):
                _check_reference(bodies, where, value, said, is_pair=is_pair(hints[key.name]))


def _check_values(mechanism: Mechanism, member: Joint | Driver) -> None:
    """What the member says of its values; expressions in them are told with the parameters that they hold."""
    table = "joints" if isinstance(member, Joint) else "drivers"
    try:
        member.check()
    except MechanismError as error:
        at_fault = {place: e for place, e in mechanism.expressions.items() if place[:2] == (table, member.name)}
        if not at_fault:
            raise
        values = dict.fromkeys(name for expression in at_fault.values() for name in expression.names)
        said = [f"{told(place).partition('] ')[2]} = {quoted(e.text)}" for place, e in at_fault.items()]
        said += [f"{name} = {float(mechanism.parameters[name].value)!r}" for name in values]
        raise type(error)(f"{error} ({listed(said)})", **error.data) from None


def _check_reference(bodies: Bodies, where: str, value: Any, reference: Reference, *, is_pair: bool) -> None:
    if is_pair and not (isinstance(value, tuple) and len(value) == 2):
        raise MechanismError(f"{where} = {quoted(value)} must be two points, ('body.point', 'body.point')")
    for one in value if is_pair else (value,):
        if not isinstance(one, str):
            raise MechanismError(f"{where} = {quoted(one)} must be text")
        if reference.kind == "point":
            _check_point(bodies, where, one)
        elif reference.kind == "body":
            _check_body(bodies, where, one)
        elif one not in reference.choices:
            raise MechanismError(f"{where} = {quoted(one)} must be one of {listed(reference.choices)}")


def _check_body(bodies: Bodies, where: str, name: str) -> None:
    if name not in bodies:
        raise MechanismError(
            f"{where}: body {quoted(name)} is not in the mechanism{suggestion(name, bodies)}; bodies: {listed(bodies)}"
        )


def _check_point(bodies: Bodies, where: str, name: str) -> None:
    body_name, dot, point = name.partition(".")
    if not dot:
        raise MechanismError(f"{where} = {quoted(name)} must be 'body.point'")
    _check_body(bodies, where, body_name)
    known = bodies[body_name].points
    if point not in known:
        raise MechanismError(
            f"{where}: body '{body_name}' has no point {quoted(point)}{suggestion(point, known)}; "
            f"its points: {listed(known)}"
        )
