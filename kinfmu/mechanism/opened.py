"""A mechanism with its plain numbers as parameters, which a page can change, and what depends on which."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from typing import Any, NamedTuple

from kinfmu.errors import RequestError
from kinfmu.mechanism import Mechanism, Parameter
from kinfmu.mechanism.expression import Computed
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.mechanism.parameters import parameters_behind
from kinfmu.units import Quantity

AXES = ("x", "y")  # of a point
_MEMBERS = {"bodies": "Body", "joints": "Joint", "loads": "Load"}


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
    numbers = count()
    return _opened(mechanism, lambda *_: _unused(f"opened_{next(numbers)}", mechanism), lambda _: "")


GROUPS = {  # of numbers, by what they measure
    "all": (),  # whatever it is
    "lengths": ("length",),
    "masses": ("mass", "inertia", "density", "areal_density"),
}


def with_open_numbers(mechanism: Mechanism, names: str | Sequence[str]) -> Mechanism:
    """Return the mechanism with plain numbers of its file as parameters, named after their places.

    Args:
        mechanism: The mechanism.
        names: What becomes a parameter: 'all', 'lengths', 'masses', or numbers by names such as 'crank.P.x' and
            'AB.length'; one of these or several. Numbers are those of `opened`, without the constants of laws, which
            can be set anyway. The words leave out zeros, such as a pin in the origin of its body: due to them
            coordinates are constant or equal, and terms vanish. A zero becomes a parameter by its name.

    Returns:
        The mechanism; it solves to the same numbers, within round-off.

    Raises:
        RequestError: A name is no number of the file, or nothing is chosen by a word, or two numbers have one name.
        MechanismError: The name of a number is that of another number, such as of a law's constant.

    """
    names = [names] if isinstance(names, str) else names
    numbers: dict[str, tuple[NumberPath, Quantity]] = {}
    used: dict[str, set[str]] = {name: {name} & {*mechanism.parameters} for name in names}

    def chosen(place: NumberPath, value: float, quantity: Quantity) -> str | None:
        if "law" in place:
            return None
        name = dotted_name(place)
        if name in numbers:
            raise RequestError(
                f"parameters: {path_text(numbers[name][0])} and {path_text(place)} would both be '{name}'; rename one"
            )
        numbers[name] = place, quantity
        words = [word for word, kinds in GROUPS.items() if value and (not kinds or _is_of(quantity, kinds))]
        asked = [word for word in (*words, name) if word in used]
        for word in asked:
            used[word].add(name)
        return name if asked else None

    change = _opened(mechanism, chosen, _description)
    for name, those in used.items():
        if not those and name in GROUPS and name != "all":
            raise RequestError(
                f"parameters: mechanism '{mechanism.name}' has no {name} that are not parameters already"
            )
        if not those and name != "all":
            raise mechanism.settable.unknown(name, [*GROUPS, *numbers])
    return change.mechanism


def dotted_name(place: NumberPath) -> str:
    """Return the name of a number as a parameter: 'crank.P.x', 'crank.mass', 'AB.length', 'gravity.y'."""
    kept = place if place[0] == "gravity" else tuple(part for part in place[1:] if part != "points")
    return place_text(kept)


def _is_of(quantity: Quantity, kinds: Sequence[str]) -> bool:
    return quantity.order == 0 and quantity.kind in kinds


def _description(place: NumberPath) -> str:
    """Return what a number is: 'Body crank: point P, x', 'Joint AB: length', 'Gravity: y'."""
    table, *rest = place
    *keys, last = rest if table == "gravity" else rest[1:]
    words = [*map(str, keys), AXES[last] if isinstance(last, int) else str(last)]
    if words[0] == "points":
        words[:2] = [f"point {words[1]}"]
    owner = "Gravity" if table == "gravity" else f"{_MEMBERS[str(table)]} {rest[0]}"
    return f"{owner}: {', '.join(words).replace('_', ' ')}"


def _opened(
    mechanism: Mechanism,
    name_of: Callable[[NumberPath, float, Quantity], str | None],
    description_of: Callable[[NumberPath], str],
) -> Opened:
    """Return the mechanism with parameters for those of its plain numbers that get a name."""
    places: dict[str, NumberPath] = {}
    parameters: dict[str, Parameter] = {}

    def open_number(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        if not isinstance(value, float) or isinstance(value, Computed) or not _can_be_opened(place, value):
            return value
        name = name_of(place, value, quantity)
        if name is None:
            return value
        places[name] = place
        parameters[name] = Parameter(value, quantity, description_of(place))
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
        for name in parameters_behind(mechanism.parameters, expression):
            point = f"{place[1]}.{place[3]}"
            if point not in found.setdefault(name, []):
                found[name].append(point)
    return found


def parameters_of(mechanism: Mechanism, joint: Joint, key: str = "") -> list[str]:
    """Return the parameters on which numbers of a joint depend, or only the number of a key."""
    path = ("joints", joint.name, key) if key else ("joints", joint.name)
    found = [one for place, one in mechanism.expressions.items() if place[: len(path)] == path]
    return sorted(parameters_behind(mechanism.parameters, *found))


def number_data(mechanism: Mechanism, path: NumberPath, value: float) -> dict[str, Any]:
    """Return a number of the file, the parameters on which it depends, and that one which is its whole expression."""
    expression = mechanism.expressions.get(path)
    names = sorted(parameters_behind(mechanism.parameters, expression)) if expression else []
    alone = expression.alone if expression and names == [expression.alone] else None
    return {"value": value, "names": names, "alone": alone}
