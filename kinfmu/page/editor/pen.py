"""What operations draw with: targets, names that are not in use, and the edits that come of them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import count, product
from string import ascii_uppercase
from typing import Any

from kinfmu.errors import MechanismError, suggestion
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.edits import Edit, Place, Put, Remove, apply, edited
from kinfmu.mechanism.expression import Computed
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.mechanism.number import given_unit
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.mechanism.repeats import expanded
from kinfmu.mechanism.valid import LARGEST_NUMBER, quoted
from kinfmu.page.editor.drawing import Drawing, Spot, written_number
from kinfmu.units import Quantity, factors

TABLES = ("bodies", "joints", "drivers", "loads", "points", "parameters", "measures")
_LETTER = re.compile(r"[A-Z]\d*$")
SAME = 1e-9  # of the size; places that are nearer are one place


class OperationArguments:
    """The arguments of one operation, each checked as it is read.

    Args:
        operation: A JSON object with the key "do".

    """

    def __init__(self, operation: Mapping[str, Any]) -> None:
        self._values = dict(operation)
        self.name = str(self._values.pop("do"))
        self._read: set[str] = set()

    def has(self, key: str) -> bool:
        """Return whether an argument is given."""
        self._read.add(key)
        return self._values.get(key) is not None

    def any(self, key: str) -> Any:
        """Return an argument as it is."""
        self._read.add(key)
        if key not in self._values:
            raise self.error(f"needs '{key}'")
        return self._values[key]

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text."""
        if default is not None and not self.has(key):
            return default
        value = self.any(key)
        if not isinstance(value, str):
            raise self.wrong(key, "text")
        return value

    def truth(self, key: str) -> bool:
        """Return True or False, False by default."""
        if not self.has(key):
            return False
        value = self.any(key)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def number(self, key: str) -> float:
        """Return a number."""
        value = _number(self.any(key))
        if value is None:
            raise self.wrong(key, f"a number up to {LARGEST_NUMBER:g}")
        return value

    def spot(self, key: str) -> Spot:
        """Return a place or a vector (x, y) in the world."""
        found = self.entries(key, "two numbers [x, y]")
        numbers = [_number(value) for value in found]
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            raise self.wrong(key, "two numbers [x, y]")
        return numbers[0], numbers[1]

    def entries(self, key: str, valid: str = "a list") -> list[Any]:
        """Return a list."""
        value = self.any(key)
        if not isinstance(value, list):
            raise self.wrong(key, valid)
        return value

    def texts(self, key: str, length: int | None = None) -> list[str]:
        """Return a list of texts."""
        valid = "a list of texts" if length is None else f"a list of {length} texts"
        found = self.entries(key, valid)
        if not found or any(not isinstance(one, str) for one in found) or (length or len(found)) != len(found):
            raise self.wrong(key, valid)
        return found

    def target(self, key: str) -> Mapping[str, Any]:
        """Return a target; 'body.point' alone is one, too."""
        value = self.any(key)
        if isinstance(value, str):
            value = {"point": value}
        if not isinstance(value, dict) or not value.keys() <= {"at", "point", "body"}:
            raise self.wrong(key, "a target: {at}, {point} or {body, at}")
        return {"do": f"{self.name}, {key}", **value}

    def finish(self) -> None:
        """Raise a MechanismError for an argument that is not read."""
        for key in self._values:
            if key not in self._read:
                raise self.error(f"'{key:.40}' is not known{suggestion(key, self._read)}")

    def error(self, text: str) -> MechanismError:
        """Return an error of this operation."""
        return MechanismError(f"{self.name}: {text}")

    def wrong(self, key: str, valid: str) -> MechanismError:
        """Return an error of an argument, which must be `valid`."""
        return self.error(f"{key} = {quoted(self._values.get(key))} must be {valid}")


def _number(value: object) -> float | None:
    """Return a finite number that is not too large; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if -LARGEST_NUMBER <= value <= LARGEST_NUMBER else None


class Pen:
    """The edits of one operation.

    Args:
        drawing: What is there before.

    Attributes:
        edits: The edits so far.
        document: The tables of the file after them.

    """

    def __init__(self, drawing: Drawing) -> None:
        self.drawing = drawing
        self.edits: list[Edit] = []
        self.document = edited(drawing.document, ())
        self._spots: dict[str, Spot] = {}  # of new points, as drawn

    # ---- edits

    def put(self, place: Place, value: Any) -> None:
        """Put a value at a place."""
        self._add(Put(place, value))

    def remove(self, place: Place) -> None:
        """Remove a place, if it is there."""
        table: Any = self.document
        for key in place:
            if not isinstance(table, Mapping) or key not in table:
                return
            table = table[key]
        self._add(Remove(place))

    def _add(self, edit: Edit) -> None:
        apply(self.document, edit)
        self.edits.append(edit)

    def written(self, place: NumberPath, old: Any, value: float, quantity: Quantity) -> Any:
        """Return a number as it is written in the place of an older one: in the same unit.

        Raises:
            MechanismError: The older one follows from parameters.

        """
        if isinstance(old, Computed):
            where = path_text(place)
            raise MechanismError(f"{where} is {quoted(old.expression.text)}: set its parameters, or put a number there")
        unit = given_unit(old)
        factor = factors(quantity, self.drawing.mechanism.length_unit).get(unit)
        return written_number(value) if factor is None else f"{written_number(value / factor)} {unit}"

    # ---- names

    def names(self) -> set[str]:
        """Return all names of members that are in use."""
        document = expanded(self.document)
        return {name for table in TABLES for name in document.get(table, {})}

    def free_name(self, wanted: str) -> str:
        """Return a name; if it is in use, the next letter in place of a letter, else the name with a number."""
        taken = self.names()
        if wanted in taken and _LETTER.match(wanted):
            return self.letter()
        return next(name for name in _numbered(wanted) if name not in taken)

    def numbered_name(self, word: str) -> str:
        """Return 'word_1', or with the next number that is not in use."""
        taken = self.names()
        return next(f"{word}_{k}" for k in count(1) if f"{word}_{k}" not in taken)

    def letter(self, others: Iterable[str] = ()) -> str:
        """Return the next letter that no point and no member has as its name, and that is not one of others."""
        of_bodies = (point for body in self._bodies().values() for point in body.get("points", {}))
        taken = {*others, *self.names(), *of_bodies}
        letters = (f"{letter}{k}" for k, letter in product(["", *range(1, 10_000)], ascii_uppercase))
        return next(letter for letter in letters if letter not in taken)

    def _bodies(self) -> Mapping[str, Any]:
        bodies = expanded(self.document).get("bodies", {})
        return {name: body for name, body in bodies.items() if isinstance(body, Mapping)}

    # ---- points

    def body(self, name: str) -> str:
        """Return the name of a body that is in the file.

        Raises:
            MechanismError: There is no such body.

        """
        if name != GROUND_NAME and name not in self._bodies():
            raise MechanismError(f"there is no body {quoted(name)}{suggestion(name, self._bodies())}")
        return name

    def spot(self, point: str) -> Spot:
        """Return the place in the world of 'body.point' as drawn."""
        return self._spots[point] if point in self._spots else self.drawing.at(point)

    def is_same(self, a: Spot, b: Spot) -> bool:
        """Return whether two places are one."""
        return math.dist(a, b) <= SAME * max(self.drawing.size, *map(abs, (*a, *b)))

    def add_point(self, body: str, spot: Spot, wanted: str = "") -> str:
        """Return 'body.point' of a body at a place: a point that is there, or a new one.

        wanted: Its name, if the body has no such point yet. Default: the next letter.
        """
        self.body(body)
        points = self._bodies().get(body, {}).get("points", {})
        for name in points:
            if self.is_same(self.spot(f"{body}.{name}"), spot):
                return f"{body}.{name}"
        bodies = self.document.get("bodies", {})
        if body != GROUND_NAME and body not in bodies:
            raise MechanismError(f"body '{body}' is one of a repeated part of the file; change its text")
        name = wanted if wanted and wanted not in points else self.letter()
        local = written_spot(self.drawing.seen_from(body, spot) if body in self.drawing.poses else spot)
        if bodies.get(body, {}).get("points"):
            self.put(("bodies", body, "points", name), local)
        else:
            self.put(("bodies", body, "points"), {name: local})
        self._spots[f"{body}.{name}"] = spot
        return f"{body}.{name}"

    def add_body(self, name: str, points: Mapping[str, Spot]) -> None:
        """Add a body whose frame is that of the world in the drawn pose."""
        places = {point: written_spot(spot) for point, spot in points.items()}
        self.put(("bodies", name), {"points": places, "start": {"x": 0, "y": 0, "phi": 0}})
        self._spots |= {f"{name}.{point}": spot for point, spot in points.items()}

    def target(self, given: Mapping[str, Any], *, ground: bool = False) -> tuple[str | None, Spot]:
        """Return the point 'body.point' of a target, None of a free place, and its place.

        ground: True to make a point of the ground at a free place.
        """
        values = OperationArguments(given)
        if values.has("point"):
            point = self.drawing.point(values.text("point"), f"{values.name}: point")
            values.has("at")  # where the point was seen
            values.finish()
            return point, self.drawing.at(point)
        spot = values.spot("at")
        if not values.has("body") and not ground:
            return None, spot
        return self.add_point(values.text("body", GROUND_NAME), spot), spot

    def pin(self, a: str, b: str) -> None:
        """Add a revolute joint between two points, named by the second."""
        if body_of(a) == body_of(b):
            raise MechanismError(f"{a} and {b} are points of one body; a pin holds two bodies together")
        name = self.free_name(point_of(b))
        self.put(("joints", name), {"type": "revolute", "between": [a, b]})


def _numbered(name: str) -> Iterator[str]:
    yield name
    for k in count(2):
        yield f"{name}_{k}"


def written_spot(spot: Spot) -> list[float | int]:
    """Return coordinates as they are written."""
    return [written_number(value) for value in spot]
