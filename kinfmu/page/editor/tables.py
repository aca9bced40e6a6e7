"""Operations on the tables of a file: setting, renaming and deleting, and edits as values."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kinfmu.errors import MechanismError, suggestion
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.checks import coordinate_orders
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.edits import Place, Remove, edited
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.opened import place_text
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.toml_document import document_of
from kinfmu.mechanism.valid import LARGEST_NUMBER, check_name, quoted
from kinfmu.page.editor.drawing import Drawing
from kinfmu.page.editor.pen import TABLES, OperationArguments, Pen
from kinfmu.page.editor.text_edits import edited_text, renamed_text
from kinfmu.units import Quantity

_DEEPEST = 8  # levels of a value
_LONGEST = 10_000  # numbers in a list
_MEASURE = re.compile(r"^\[measures\.(\w+)\]")
_NUMBER = Quantity("number")
_OF_POINTS = ("rod", "plate")  # keys of a body that name its points, with those that follow from them
_WITH_POINTS = ("density", "areal_density", "thickness", "width")


def set_value(pen: Pen, values: OperationArguments) -> None:
    """Put a value at a place; the last key may be the number of an entry of a list."""
    place = values.entries("place")
    value = _value(values, "value", values.any("value"))
    *tables, last = _place(values, "place", place, with_number=True)
    if isinstance(last, int):
        array = _at(pen.document, tables)
        if not isinstance(array, list) or not 0 <= last < len(array):
            raise values.error(f"{'.'.join(tables)} has no entry {last}")
        pen.put(tuple(tables), [value if k == last else one for k, one in enumerate(array)])
    else:
        pen.put((*tables, last), value)


def set_numbers(pen: Pen, values: OperationArguments) -> None:
    """Set numbers by the names that a page has for them, such as 'bodies.crank.points.P.x' or 'motor.speed'."""
    given = values.any("values")
    if not isinstance(given, dict):
        raise values.wrong("values", "numbers by name")
    mechanism = pen.drawing.mechanism
    numbers = {place_text(path): (path, old, quantity) for path, old, quantity in mechanism.members.numbers()}
    for constant in (*mechanism.law_constants, *mechanism.load_constants):
        table = "drivers" if constant in mechanism.law_constants else "loads"
        numbers[constant.name] = (table, constant.owner, "law", constant.key), constant.value, constant.quantity
    for name, parameter in mechanism.parameters.items():
        numbers[name] = ("parameters", name), parameter.value, parameter.quantity or _NUMBER
    for name, value in given.items():
        if name not in numbers:
            raise values.error(f"there is no number {quoted(name)}{suggestion(name, numbers)}")
        path, old, quantity = numbers[name]
        number = OperationArguments({"do": f"{values.name}: {name}", "value": value}).number("value")
        if number != float(old):
            _put_number(pen, values, path, pen.written(path, old, number, quantity))


def _put_number(pen: Pen, values: OperationArguments, path: NumberPath, written: Any) -> None:
    """Put a number at its path; numbers of laws are in the table of their owner, or in a list of it."""
    *tables, last = (key for key in path if key != "law")
    table = _at(pen.document, tables)
    word, _, count = str(last).rpartition("_")
    if path[0] == "parameters" and isinstance(_at(pen.document, path), Mapping):
        pen.put((*map(str, path), "value"), written)
    elif isinstance(last, int):
        if not isinstance(table, list):
            raise values.error(f"{place_text(path)} is in a repeated part of the file; change its text")
        pen.put(tuple(map(str, tables)), [written if k == last else one for k, one in enumerate(table)])
    elif not isinstance(table, Mapping):
        raise values.error(f"{place_text(path)} is in a repeated part of the file; change its text")
    elif word in ("rise", "duration") and "segments" in table:
        segments = [
            {**one, word: written} if k == int(count) else one for k, one in enumerate(table["segments"], start=1)
        ]
        pen.put((*map(str, tables), "segments"), segments)
    elif "coefficients" in table and "law" in path:
        listed = [written if f"c{k}" == last else one for k, one in enumerate(table["coefficients"])]
        pen.put((*map(str, tables), "coefficients"), listed)
    else:
        pen.put((*map(str, tables), last), written)


def edit(pen: Pen, values: OperationArguments) -> None:
    """Make edits that are given as values: {put, value} and {remove}."""
    for one in values.entries("edits"):
        if not isinstance(one, dict) or one.keys() not in ({"put", "value"}, {"remove"}):
            raise values.wrong("edits", "a list of {put, value} and {remove}")
        if "put" in one:
            place = _place(values, "edits", one["put"])
            pen.put(place, _value(values, "edits", one["value"]))
        else:
            place = _place(values, "edits", one["remove"])
            edited(pen.document, [Remove(place)])
            pen.remove(place)


def _place(values: OperationArguments, key: str, place: object, *, with_number: bool = False) -> tuple[Any, ...]:
    if not isinstance(place, list) or not 0 < len(place) <= _DEEPEST:
        raise values.wrong(key, "a list of keys")
    *tables, last = place
    is_number = with_number and isinstance(last, int) and not isinstance(last, bool) and bool(tables)
    if any(not isinstance(one, str) or not one for one in tables) or not (
        is_number or (isinstance(last, str) and last)
    ):
        raise values.wrong(key, "a list of keys")
    return tuple(place)


def _value(values: OperationArguments, key: str, value: Any, depth: int = 0) -> Any:
    """Return what TOML can hold of what JSON can."""
    if depth > _DEEPEST:
        raise values.error(f"{key}: nested too deeply")
    if isinstance(value, dict):
        return {name: _value(values, key, one, depth + 1) for name, one in value.items()}
    if isinstance(value, list) and len(value) <= _LONGEST:
        return [_value(values, key, one, depth + 1) for one in value]
    if isinstance(value, str | bool):
        return value
    if isinstance(value, int | float) and abs(value) <= LARGEST_NUMBER:
        return value if abs(value) < 2**53 else float(value)
    raise values.error(f"{key}: {quoted(value)} cannot be written into a file")


def _at(document: Any, place: Iterable[str | int]) -> Any:
    """Return what is at a place; None if nothing is there."""
    for key in place:
        if not isinstance(document, Mapping) or key not in document:
            return None
        document = document[key]
    return document


def references(member: Any) -> set[str]:
    """Return the points and bodies that a joint, driver, load or measured quantity names."""
    found: set[str] = set()
    cls: object = type(member)  # object: mypy does not take type[Any] for hashable
    for key in keys_of(cls):
        value = getattr(member, key.name)
        if isinstance(value, PoseQuantity):
            found |= references(value)
        elif key.refers is not None and key.refers.kind in ("point", "body") and value is not None:
            found |= {value} if isinstance(value, str) else {*value}
    return found


def delete(drawing: Drawing, values: OperationArguments) -> Drawing:
    """Remove a place with all that depends on it."""
    place = _place(values, "place", values.entries("place"))
    if _at(drawing.document, place) is None:
        raise values.error(f"{'.'.join(place)} is not in the file")
    pen = Pen(drawing)
    pen.remove(place)
    if place[0] == "bodies" and (len(place) == 2 or (len(place) == 4 and place[2] == "points")):
        _remove_dependents(pen, place[1], place[3] if len(place) == 4 else "")
    while True:
        try:
            return drawing.with_edits(pen.edits)
        except MechanismError as problem:  # a measure of what is no longer there
            found = _MEASURE.match(str(problem))
            if found is None or found[1] not in pen.document.get("measures", {}):
                raise
            pen.remove(("measures", found[1]))


def _remove_dependents(pen: Pen, body: str, point: str) -> None:
    """Remove all that names a body, or a point of it."""

    def is_gone(name: str) -> bool:
        return name == f"{body}.{point}" if point else name == body or name.startswith(f"{body}.")

    mechanism = pen.drawing.mechanism
    for table in ("joints", "drivers", "loads"):
        for member in getattr(mechanism, table):
            if any(map(is_gone, references(member))):
                pen.remove((table, member.name))
    for name, target in mechanism.points.items():
        if is_gone(target):
            pen.remove(("points", name))
    coordinates = pen.document.get("outputs", {}).get("coordinates")
    if not point and isinstance(coordinates, list):
        rest = [name for name in coordinates if not is_gone(name)]
        pen.put(("outputs", "coordinates"), rest or "moving")
    if point and any(point in pen.document["bodies"][body].get(key, ()) for key in _OF_POINTS):
        for key in (*_OF_POINTS, *_WITH_POINTS):
            pen.remove(("bodies", body, key))


def rename(drawing: Drawing, values: OperationArguments) -> Drawing:
    """Give a member or a point another name, also where it is named."""
    place = _place(values, "place", values.entries("place"))
    name = values.text("name")
    check_name("name", name)
    is_point = len(place) == 4 and place[0] == "bodies" and place[2] == "points"
    if not is_point and (len(place) != 2 or place[0] not in TABLES or place[0] == "parameters"):
        raise values.error(f"{'.'.join(place)} has no name that can be changed; its text can")
    if _at(drawing.document, place) is None:
        raise values.error(f"{'.'.join(place)} is not in the file")
    if place[-1] == name:
        raise values.error(f"this is its name already: '{name}'")
    if place == ("bodies", GROUND_NAME) or (place[0] == "bodies" and not is_point and name == GROUND_NAME):
        raise values.error("the ground keeps its name")
    if _at(drawing.document, (*place[:-1], name)) is not None:
        raise values.error(f"the name '{name}' is in use")
    pen = Pen(drawing)
    _rename_references(pen, place, name)
    text = renamed_text(drawing.text, drawing.document, place, name)
    edits = [_moved_edit(one, place, name) for one in pen.edits]
    return Drawing.of(edited_text(text, document_of(text, "the text"), edits), drawing.folder)


def _moved_edit(edit: Any, place: Place, name: str) -> Any:
    """Return an edit in a file in which a place has another name."""
    if edit.place[: len(place)] == place:
        return edit._replace(place=(*place[:-1], name, *edit.place[len(place) :]))
    return edit


def _rename_references(pen: Pen, place: Place, name: str) -> None:
    """Put the new name of a member or of a point wherever the file names it."""
    mechanism, document = pen.drawing.mechanism, pen.document
    old, is_point = ".".join(place[1::2]), len(place) == 4
    new = f"{place[1]}.{name}" if is_point else name
    known = coordinate_orders(mechanism.coordinate_names, mechanism.points)
    of_forces = place[0] in ("joints", "drivers", "loads")

    def reference(text: str) -> str:
        is_inside = not is_point and text.startswith(f"{old}.")
        return new + text[len(old) :] if place[0] == "bodies" and (text == old or is_inside) else text

    def coordinate(text: str) -> str:
        if is_point:
            return reference(text)
        is_own = text.startswith(f"{old}.") and (text not in known if of_forces else place[0] in ("bodies", "points"))
        return new + text[len(old) :] if is_own else text

    def put(at: Place, change: Callable[[str], str]) -> None:
        found = _at(document, at)
        if isinstance(found, str) and change(found) != found:
            pen.put(at, change(found))
        elif isinstance(found, list):
            texts = [change(one) if isinstance(one, str) else one for one in found]
            if texts != found:
                pen.put(at, texts)

    def look(at: Place, member: Any) -> None:
        cls: object = type(member)
        for key in keys_of(cls):
            value = getattr(member, key.name)
            kind = key.refers.kind if key.refers is not None else ""
            if isinstance(value, PoseQuantity):
                look((*at, key.name), value)
            elif kind in ("point", "body"):
                put((*at, key.name), reference)
            elif kind == "coordinate" or key.takes == "measured":
                put((*at, key.name), coordinate)

    for table in ("joints", "drivers", "loads", "measures"):
        for member in getattr(mechanism, table):
            look((table, member.name), member)
    for interest in mechanism.points:
        put(("points", interest), reference)
    if place[0] == "bodies":
        put(("outputs", "coordinates"), coordinate)
    if is_point:
        for key in _OF_POINTS:
            put(("bodies", place[1], key), lambda text: name if text == place[3] else text)
