"""Checks of a mechanism: names, references and values; messages state table and key."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kinfmu.errors import MechanismError, listed, suggestion, valid_names
from kinfmu.mechanism.body import GROUND_NAME, Body
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.force_names import measured_forces
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.measures import READINGS, Reading
from kinfmu.mechanism.members import Bodies, Members, NumberPath, path_text
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.mechanism.settings import law_constants
from kinfmu.mechanism.valid import check_line, check_name, quoted
from kinfmu.units import METRES, CoordinateName, factors

NO_DRIVER = "[drivers] there is no driver: "  # before a measure that needs one
_EFFORTS = ("torque", "force", "power")  # nouns of forces of drivers; joints have forces, too
_OF_MECHANISM = ("shaking_force", "shaking_moment", "kinetic_energy", "potential_energy")
_KEY = re.compile(r"^.*\.|_\d+$")  # what a key has around its word: 'rise' of 'law.rise_1'
MOST_BODIES = 20_000  # fits into the memory of an ordinary computer


def check_header(name: str, title: str, length_unit: str) -> None:
    """Raise a MechanismError for an invalid unit, name or title."""
    if length_unit not in METRES:
        raise MechanismError(
            f"[units] length = {quoted(length_unit)} is not a unit of length{valid_names(length_unit, METRES)}"
        )
    check_name("name =", name)
    check_line("title", title)


def check_names(members: Members, points: Mapping[str, str]) -> None:
    """Raise a MechanismError for an invalid name. This comes before other checks: paths of numbers contain names."""
    if len(members.bodies) > MOST_BODIES:
        raise MechanismError(f"[bodies] holds {len(members.bodies)} bodies; {MOST_BODIES} at most")
    tables: dict[str, Iterable[Body | Joint | Driver | Load | Reading]] = {
        "bodies": members.bodies,
        "joints": members.joints,
        "drivers": members.drivers,
        "loads": members.loads,
        "measures": members.measures,
    }
    for table, rows in tables.items():
        _check_names(table, [row.name for row in rows])
    _check_names("points", points)


def check_members(
    members: Members,
    parameters: Mapping[str, Parameter],
    expressions: Mapping[NumberPath, Expression],
    length_unit: str,
) -> None:
    """Raise a MechanismError that states table and key of the first invalid reference or value."""
    if not members.moving_bodies:
        raise MechanismError("[bodies] has only the ground; a mechanism needs a body that can move")
    for body in members.bodies:
        for name in body.points:
            check_name(f"[bodies.{body.name}] points", name)
        if body.is_ground and any(value is not None for value in body.start):
            raise MechanismError("[bodies.ground] start: the ground does not move, its frame is the world's")
    bodies = members.bodies_by_name
    for body in members.bodies:
        _with_causes(("bodies", body.name), body.check_mass, parameters, expressions, length_unit)
    acting: tuple[Joint | Driver | Load, ...] = (*members.joints, *members.drivers, *members.loads)
    for member in acting:
        _check_references(bodies, member)
        _with_causes((table_of(member), member.name), member.check, parameters, expressions, length_unit)
    _check_names_of_results(members, parameters, expressions)


def check_outputs(members: Members, points: Mapping[str, str], coordinates: str | tuple[str, ...]) -> None:
    """Raise a MechanismError for an invalid point of interest or choice of coordinates."""
    bodies = members.bodies_by_name
    for name, target in points.items():
        _check_point(bodies, f"[points] {name}", target)
        if name in bodies:
            raise MechanismError(f"[points] {name}: a body has this name already, so '{name}.x' would be ambiguous")
    if isinstance(coordinates, str):
        if coordinates not in ("moving", "all"):
            raise MechanismError(
                f"[outputs] coordinates = {quoted(coordinates)} must be 'moving', 'all' or a list of names"
            )
        return
    known: dict[str, None] = dict.fromkeys(members.coordinate_names)
    for name in coordinates:
        if name not in known:
            raise MechanismError(
                f"[outputs] coordinates: {quoted(name)} is not a coordinate of this mechanism"
                f"{valid_names(name, known, 'coordinates')}"
            )
    if len(set(coordinates)) < len(coordinates):
        raise MechanismError("[outputs] coordinates names a coordinate twice")


def check_readings(members: Members, known: Mapping[str, Any]) -> None:
    """Raise a MechanismError for an invalid reference or value of a measure; known: as of `coordinate_orders`."""
    for reading in members.measures:
        _check_reading(members, known, reading)


def coordinate_orders(names: Iterable[CoordinateName], points: Iterable[str]) -> dict[str, tuple[CoordinateName, int]]:
    """Return each coordinate of a body or of a point of interest, and its rates, with the coordinate and the order."""
    of_points = (CoordinateName(point, axis) for point in points for axis in ("x", "y"))
    return {name.derivative(order): (name, order) for name in (*names, *of_points) for order in range(3)}


def _check_reading(members: Members, known: Mapping[str, Any], reading: Reading) -> None:
    where = f"[measures.{reading.name}] "
    _check_fields(members.bodies_by_name, where, reading)
    for key in keys_of(type(reading)):
        value = getattr(reading, key.name)
        is_measured = key.takes == "measured" or (key.refers is not None and key.refers.kind == "coordinate")
        if not is_measured or value is None or isinstance(value, PoseQuantity):
            continue
        if not isinstance(value, str):
            raise MechanismError(f"{where}{key.name} = {quoted(value)} must be a coordinate or a measured quantity")
        is_point = reading.reads_points and value in members.body_points
        forces = measured_forces(members)
        if value in forces and value not in known:
            if not reading.reads_forces:
                valid = listed(cls.type for cls in READINGS if cls.reads_forces)
                raise MechanismError(
                    f"{where}{key.name}: {quoted(value)} is a force, which has no rates; types for forces: {valid}"
                )
            continue
        if value not in known and not is_point:
            cause = _why_no_force(members, value)
            if cause.startswith("there is no driver") and not members.drivers:
                body = value.rpartition(".")[0]
                raise MechanismError(
                    f"{NO_DRIVER}{where}{key.name}: {quoted(value)} is the effort of one; add [drivers.{body}] with "
                    "the keys type, of and law"
                )
            if cause:
                raise MechanismError(f"{where}{key.name}: {quoted(value)} is not there: {cause}")
            near = suggestion(value, [*known, *forces])
            raise MechanismError(
                f"{where}{key.name}: {quoted(value)} is not a coordinate of this mechanism{near}; "
                f"coordinates: {listed(name for name, (_, order) in known.items() if not order)}"
            )
    reading.check()


def _why_no_force(members: Members, name: str) -> str:
    """Return why a mechanism has no force of a name such as 'crank.torque'; '' if it is no such name."""
    owner, _, noun = name.rpartition(".")
    drivers, joints = ({one.name for one in found} for found in (members.drivers, members.joints))
    if noun in _EFFORTS and owner not in joints | drivers and owner in members.bodies_by_name:
        near = suggestion(owner, drivers)
        return f"there is no driver '{owner}'{near}; drivers: {listed(member.name for member in members.drivers)}"
    is_force = (noun in _EFFORTS and owner in joints | drivers) or name in _OF_MECHANISM
    if is_force and not (members.loads or members.has_masses):
        return "without masses and loads there are no forces; give a body a mass, such as mass = '1.2 kg'"
    return ""


def _check_names(table: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        check_name(f"[{table}]", name)
        if name in seen:
            raise MechanismError(f"[{table}] '{name}' is defined twice")
        seen.add(name)


def _check_names_of_results(
    members: Members, parameters: Mapping[str, Parameter], expressions: Mapping[NumberPath, Expression]
) -> None:
    """Raise a MechanismError for a name that two inputs, outputs or settings would have."""
    _check_dotted(members, [name for name in parameters if "." in name], parameters, expressions)
    given: tuple[Driver | Load, ...] = (*members.drivers, *members.loads)
    for member in given:
        what = "driver" if isinstance(member, Driver) else "load"
        for name in member.inputs():
            if name in parameters:
                raise MechanismError(f"[parameters] {name}: {what} '{member.name}' has an input of this name already")
    drivers, joints = ({member.name for member in own} for own in (members.drivers, members.joints))
    for load in members.loads:
        if load.name in drivers:
            raise MechanismError(f"[loads.{load.name}]: a driver has this name already; give the load another one")
        if load.columns and load.name in joints:  # such as spring.force
            raise MechanismError(f"[loads.{load.name}]: a joint has this name already; give the load another one")


def _check_dotted(
    members: Members, dotted: Iterable[str], parameters: Iterable[str], expressions: Mapping[NumberPath, Expression]
) -> None:
    """Raise a MechanismError for parameters such as 'crank.P.x' whose names are taken, or equal others in code."""
    taken: dict[str, str] = {}
    for name in dotted:
        if not taken:
            constants = law_constants((*members.drivers, *members.loads), expressions)
            taken = {one.name: f"the law of '{one.owner}' has a constant" for one in constants}
            taken |= dict.fromkeys(members.coordinate_names, "a body has a coordinate")
        if name in taken:
            raise MechanismError(f"[parameters] {name}: {taken[name]} of this name already")
    in_code: dict[str, str] = {}
    for name in parameters if taken else ():
        other = in_code.setdefault(name.replace(".", "_"), name)
        if other != name:
            raise MechanismError(f"[parameters] {other} and {name} differ only in dots and underscores; rename one")


def table_of(member: Joint | Driver | Load) -> str:
    """Return the table of a file in which a member is."""
    return "joints" if isinstance(member, Joint) else "drivers" if isinstance(member, Driver) else "loads"


def _check_references(bodies: Bodies, member: Joint | Driver | Load) -> None:
    table = table_of(member)
    _check_fields(bodies, f"[{table}.{member.name}] ", member)
    touched = member.acts_on() if isinstance(member, Load) else member.bodies()
    if len(touched) > 1 and len(set(touched)) == 1:
        raise MechanismError(f"[{table}.{member.name}] joins body '{touched[0]}' to itself")
    if set(touched) == {GROUND_NAME}:
        raise MechanismError(f"[{table}.{member.name}] acts on the ground only, which does not move")


def _check_fields(bodies: Bodies, before: str, member: Joint | Driver | Load | PoseQuantity | Reading) -> None:
    """Check the references in its fields; messages put `before` in front of the key."""
    for key in keys_of(type(member)):
        where, value = f"{before}{key.name}", getattr(member, key.name)
        if isinstance(value, PoseQuantity):
            _check_fields(bodies, f"{where}.", value)
        elif key.refers is not None and not (value is None and key.default is None):
            _check_reference(bodies, where, value, key.refers, is_pair=key.takes == "pair")


def _with_causes(
    owner: tuple[str, str],
    check: Callable[[], None],
    parameters: Mapping[str, Parameter],
    expressions: Mapping[NumberPath, Expression],
    length_unit: str,
) -> None:
    """Run a member's own check; an error also states those expressions that give the keys that it names, if any."""
    try:
        check()
    except MechanismError as error:
        text = str(error)
        own = {place: path_text(place).partition("] ")[2] for place in expressions if place[:2] == owner}
        at_fault = {place: expressions[place] for place, key in own.items() if _KEY.sub("", key) in text}
        if not at_fault:
            raise
        values = dict.fromkeys(name for expression in at_fault.values() for name in expression.names)
        causes = [f"{path_text(place).partition('] ')[2]} = {quoted(e.text)}" for place, e in at_fault.items()]
        causes += [f"{name} = {_as_written(parameters[name], length_unit)}" for name in values]
        raise type(error)(f"{error} ({listed(causes)})", **error.data) from None


def _as_written(parameter: Parameter, length_unit: str) -> str:
    """Return the value of a parameter in the unit in which it is written."""
    value = float(parameter.value)
    factor = factors(parameter.quantity, length_unit).get(parameter.unit) if parameter.quantity else None
    return repr(value) if factor is None else f"{value / factor:.12g} {parameter.unit}"


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
        elif reference.kind == "choice" and one not in reference.choices:
            raise MechanismError(f"{where} = {quoted(one)} must be one of {listed(reference.choices)}")


def _check_body(bodies: Bodies, where: str, name: str) -> None:
    body = name.partition(".")[0]
    if body != name and body in bodies:
        raise MechanismError(f"{where}: {quoted(name)} must be a body; did you mean '{body}'?")
    if name not in bodies:
        raise MechanismError(
            f"{where}: body {quoted(name)} is not in the mechanism{valid_names(name, bodies, 'bodies')}"
        )


def _check_point(bodies: Bodies, where: str, name: str) -> None:
    body_name, dot, point = name.partition(".")
    if not dot:
        raise MechanismError(f"{where} = {quoted(name)} must be 'body.point'")
    _check_body(bodies, where, body_name)
    known = bodies[body_name].points
    if point not in known:
        raise MechanismError(
            f"{where}: body '{body_name}' has no point {quoted(point)}{valid_names(point, known, 'its points')}"
        )
