"""The numbers of a mechanism by their paths, for messages and for expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from operator import is_
from typing import Any

from kinfmu.mechanism.body import Body, Gravity, Point, RunSettings, Start
from kinfmu.mechanism.declared import keys_of, quantities_of
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.laws import Law, LawQuantity
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.units import CoordinateName, Quantity, is_of_angle

NumberPath = tuple[str | int, ...]
"""Path of a number: ("bodies", body, "points", point, 0 or 1), ("bodies", body, "start", "x" | "y" | "phi"),
("bodies", body, key of a mass), ("bodies", body, "center_of_mass", 0 or 1), ("gravity", "x" | "y"),
("joints" | "drivers" | "loads", name, key), ("joints" | "loads", name, measure, key), ("run", key), and of a law
(table, name, "law", constant) or (table, name, "law", "points", number, 0 or 1), and
("measures", measure, key), ("measures", measure, "targets", number, 0 or 1)."""

Bodies = Mapping[str, Body]  # by name
Change = Callable[[NumberPath, Any, Quantity], Any]  # place, value and quantity -> new value
LENGTH = Quantity("length")
COORDINATES = ("x", "y", "phi")


class MechanismParts:
    """What follows from the bodies, joints, drivers and loads of a mechanism, or of its members."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    drivers: tuple[Driver, ...]
    loads: tuple[Load, ...]

    @property
    def moving_bodies(self) -> tuple[Body, ...]:
        """Bodies other than the ground, in file order."""
        return tuple(body for body in self.bodies if not body.is_ground)

    @property
    def has_masses(self) -> bool:
        """True if a body has a mass."""
        return any(body.has_mass for body in self.bodies)

    @property
    def coordinate_names(self) -> tuple[CoordinateName, ...]:
        """All generalized coordinates x, y, phi of the moving bodies, in file order."""
        return tuple(CoordinateName(body.name, axis) for body in self.moving_bodies for axis in COORDINATES)

    @property
    def body_points(self) -> dict[str, tuple[Value, Value]]:
        """Body-fixed coordinates of every point, by 'body.point'."""
        return {f"{body.name}.{name}": point for body in self.bodies for name, point in body.points.items()}


@dataclass(frozen=True)
class Members(MechanismParts):
    """The parts of a mechanism that contain numbers, in any arithmetic."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    drivers: tuple[Driver, ...]
    run: RunSettings
    measures: tuple[Reading, ...] = ()
    gravity: Gravity | None = None
    loads: tuple[Load, ...] = ()

    @property
    def bodies_by_name(self) -> Bodies:
        """All bodies by their names."""
        return {body.name: body for body in self.bodies}

    @property
    def driver_kind(self) -> str:
        """What the value of the driver is, of which measures choose a part: time where several drivers move."""
        return self.drivers[0].quantity.kind if len(self.drivers) == 1 else "time"

    def numbers(self) -> list[tuple[NumberPath, Any, Quantity]]:
        """Return each number with its path and its quantity, in the order of the file."""
        numbers: list[tuple[NumberPath, Any, Quantity]] = []

        def look(place: NumberPath, value: Any, quantity: Quantity) -> Any:
            numbers.append((place, value, quantity))
            return value

        self.changed(look)
        return numbers

    def changed(self, change: Change) -> Members:
        """Return the members with each number replaced by change(path, value, quantity); equal parts stay identical."""
        times = quantities_of(RunSettings).items()
        run = {key: change(("run", key), getattr(self.run, key), quantity) for key, quantity in times}
        return Members(
            tuple(_body(body, change) for body in self.bodies),
            tuple(_member(joint, ("joints", joint.name), change) for joint in self.joints),
            tuple(_member(driver, ("drivers", driver.name), change) for driver in self.drivers),
            _replaced(self.run, run),
            tuple(_reading(reading, self.driver_kind, change) for reading in self.measures),
            _gravity(self.gravity, change),
            tuple(_member(load, ("loads", load.name), change) for load in self.loads),
        )


def texts_of(member: object) -> set[object]:
    """Return the texts in the fields of a joint, driver, load or measure, and in those of its measured quantity."""
    found: set[object] = set()
    for entry in fields(member):  # type: ignore[arg-type]  # all members are dataclasses
        value = getattr(member, entry.name)
        if isinstance(value, PoseQuantity):
            found |= texts_of(value)
        else:
            found |= {value} if isinstance(value, str) else {*value} if isinstance(value, tuple) else set()
    return found


def path_text(place: NumberPath) -> str:
    """Return a path as in messages: '[bodies.crank] points.P', '[joints.AB] length', '[drivers.crank] speed'."""
    if place[0] in ("run", "gravity"):
        return f"[{place[0]}] {place[1]}"
    table, name, *path = place
    keys = [str(key) for key in path if key != "law" and not isinstance(key, int)]
    return f"[{table}.{name}] {'.'.join(keys)}"


def _body(body: Body, change: Change) -> Body:
    points = {name: _point(point, ("bodies", body.name, "points", name), change) for name, point in body.points.items()}
    starts = quantities_of(Start)
    start = Start(
        *(
            None if value is None else change(("bodies", body.name, "start", key), value, starts[key])
            for key, value in body.start._asdict().items()
        )
    )
    values: dict[str, Any] = {
        "points": body.points if all(points[name] is point for name, point in body.points.items()) else points,
        "start": body.start if all(map(is_, start, body.start)) else start,
        "center_of_mass": _point(body.center_of_mass, ("bodies", body.name, "center_of_mass"), change),
        **{
            key: change(("bodies", body.name, key), getattr(body, key), quantity)
            for key, quantity in quantities_of(Body).items()
        },
    }
    return _replaced(body, values)  # type: ignore[no-any-return]  # of the same class


def _point(point: Point, place: NumberPath, change: Change) -> Point:
    new = tuple(change((*place, k), point[k], LENGTH) for k in (0, 1))
    return point if all(map(is_, new, point)) else Point(*new)


def _gravity(gravity: Gravity | None, change: Change) -> Gravity | None:
    if gravity is None:
        return None
    quantities = quantities_of(Gravity)
    return Gravity(*(change(("gravity", key), value, quantities[key]) for key, value in gravity._asdict().items()))


def _member(member: Any, place: NumberPath, change: Change) -> Any:
    cls: object = type(member)  # object: mypy does not take type[Any] for hashable
    values = {}
    for key in keys_of(cls):
        part = getattr(member, key.name)
        if isinstance(key.measures, Quantity) and not (part is None and key.default is None):
            values[key.name] = change((*place, key.name), part, key.measures)
        elif isinstance(part, Law):
            values[key.name] = _law(part, member.law_kinds, (*place, key.name), change)
        elif isinstance(part, PoseQuantity):
            values[key.name] = _member(part, (*place, key.name), change)
    return _replaced(member, values)


def _reading(reading: Reading, driver_kind: str, change: Change) -> Reading:
    """Return a measure with changed numbers; those of its quantity's and its driver's kinds come after the others."""
    place: NumberPath = ("measures", reading.name)
    values = {}
    for key in keys_of(type(reading)):
        part = getattr(reading, key.name)
        if isinstance(key.measures, LawQuantity) and part is not None:
            quantity = key.measures.quantity(kind_of_measured(getattr(reading, "of", "")), driver_kind)
            values[key.name] = change((*place, key.name), part, quantity)
        elif key.takes == "points":
            new = tuple(
                tuple(change((*place, key.name, k, axis), point[axis], LENGTH) for axis in (0, 1))
                for k, point in enumerate(part)
            )
            is_same = all(map(is_, (one for point in new for one in point), (one for point in part for one in point)))
            values[key.name] = part if is_same else new
    return _member(_replaced(reading, values), place, change)  # type: ignore[no-any-return]  # of the same class


def kind_of_measured(of: object) -> str:
    """Return 'length' or 'angle': what a measured quantity is, a coordinate by its name or a PoseQuantity."""
    if isinstance(of, PoseQuantity):
        return of.kind
    return "angle" if isinstance(of, str) and is_of_angle(of) else "length"


def _law(law: Law, kinds: tuple[str, str], place: NumberPath, change: Change) -> Law:
    old = law.numbers()
    new = {path: change((*place, *path), value, measured.quantity(*kinds)) for path, (value, measured) in old.items()}
    return law if all(new[path] is old[path].value for path in old) else law.with_numbers(new)


def _replaced(member: Any, values: Mapping[str, Any]) -> Any:
    """Return the member with these values in its fields; itself if nothing changes."""
    new = {key: value for key, value in values.items() if value is not getattr(member, key)}
    return replace(member, **new) if new else member
