"""A mechanism with its plain numbers as parameters, which a page can change, and what depends on which."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from kinfmu.mechanism import Mechanism, Parameter
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.members import NumberPath
from kinfmu.units import Quantity

AXES = ("x", "y")  # of a point


class Opened(NamedTuple):
    """A mechanism whose plain numbers are parameters.

    Attributes:
        mechanism: The mechanism; it solves to the same numbers, within round-off.
        places: The paths of the numbers that became parameters, by the names of these.

    """

    mechanism: Mechanism
    places: dict[str, NumberPath]

    @property
    def labels(self) -> dict[str, str]:
        """Places as text, such as 'bodies.crank.points.P.x', by the names of the parameters."""
        return {name: place_text(place) for name, place in self.places.items()}


def opened(mechanism: Mechanism) -> Opened:
    """Return a mechanism with parameters in place of the plain numbers of its bodies, joints, loads and gravity.

    These are coordinates of points, masses and moments of inertia, gravity, lengths, angles, offsets and ratios of
    joints, and constants of loads and of their laws. Numbers given by expressions stay expressions, constants of the
    drivers' laws can be set anyway, and laws of cams and couplings and tables stay numbers.
    """
    places: dict[str, NumberPath] = {}
    parameters: dict[str, Parameter] = {}

    def open_number(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        if not isinstance(value, float) or isinstance(value, Computed) or not _can_be_opened(place, value):
            return value
        name = _unused(f"opened_{len(places)}", mechanism)
        places[name] = place
        parameters[name] = Parameter(value, quantity)
        return name

    members = mechanism.members.changed(open_number)
    changed = replace(
        mechanism,
        bodies=members.bodies,
        joints=members.joints,
        loads=members.loads,
        gravity=members.gravity,
        parameters={**mechanism.parameters, **parameters},
    )
    return Opened(changed, places)


def _can_be_opened(place: NumberPath, value: float) -> bool:
    """Return whether a page can set the number of a place; a body without a mass has zeros that are in no file."""
    if place[0] == "bodies":
        return place[2] == "points" or (place[2] != "start" and value != 0.0)
    if place[0] == "joints":
        return "law" not in place
    return place[0] == "gravity" or (place[0] == "loads" and "points" not in place)


def place_text(place: NumberPath) -> str:
    """Return the place of a number in a mechanism file as text, such as 'bodies.crank.points.P.x'."""
    *tables, last = place
    return ".".join([*map(str, tables), AXES[last] if isinstance(last, int) else last])


def _unused(name: str, mechanism: Mechanism) -> str:
    """Return the name, longer if the mechanism has a parameter of this name."""
    while name in mechanism.parameters:
        name += "_"
    return name


def dependent_points(mechanism: Mechanism) -> dict[str, list[str]]:
    """Return for each parameter the points 'body.point' whose coordinates depend on it."""
    found: dict[str, list[str]] = {}
    for place, expression in mechanism.expressions.items():
        if place[0] != "bodies" or place[2] != "points":
            continue
        for name in parameters_behind(mechanism, expression):
            point = f"{place[1]}.{place[3]}"
            if point not in found.setdefault(name, []):
                found[name].append(point)
    return found


def parameters_of(mechanism: Mechanism, joint: Joint, key: str = "") -> list[str]:
    """Return the parameters on which numbers of a joint depend, or only the number of a key."""
    path = ("joints", joint.name, key) if key else ("joints", joint.name)
    found = [one for place, one in mechanism.expressions.items() if place[: len(path)] == path]
    return sorted({name for expression in found for name in parameters_behind(mechanism, expression)})


def number_data(mechanism: Mechanism, path: NumberPath, value: float) -> dict[str, Any]:
    """Return a number of the file, the parameters on which it depends, and that one which is its whole expression."""
    expression = mechanism.expressions.get(path)
    names = sorted(parameters_behind(mechanism, expression)) if expression else []
    alone = expression.alone if expression and names == [expression.alone] else None
    return {"value": value, "names": names, "alone": alone}


def parameters_behind(mechanism: Mechanism, expression: Expression) -> set[str]:
    """Return the parameters on which an expression depends."""
    names, seen = list(expression.names), set()
    while names:
        name = names.pop()
        if name not in seen:
            seen.add(name)
            other = mechanism.parameters[name].expression
            names += other.names if other else ()
    return seen
