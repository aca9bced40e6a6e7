"""Operations of the page on a drawing: each becomes edits of the text of its file."""

from __future__ import annotations

from collections.abc import Callable

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.files import suffix_of
from kinfmu.mechanism.imports import imported, is_pmks_link
from kinfmu.mechanism.valid import quoted
from kinfmu.page.editor.drawing import Drawing
from kinfmu.page.editor.moving import length, move
from kinfmu.page.editor.parts import (
    bar,
    cam,
    cylinder,
    force,
    gear,
    ground,
    interest,
    motor,
    pin,
    point,
    slider,
    slot,
    spring,
)
from kinfmu.page.editor.pen import OperationArguments, Pen
from kinfmu.page.editor.tables import delete, edit, rename, set_numbers, set_value

_THAT_MOVE = ("move", "length", "pin")  # points; bodies stay where they are
MOST_OPERATIONS = 1000  # in one request


def _replace(drawing: Drawing, values: OperationArguments) -> Drawing:
    """Return the drawing of another text: a mechanism file, a link of PMKS+, or the file of another program.

    The name of the file that it comes from shows what it is.
    """
    text, name = values.text("text"), values.text("name", "")
    if is_pmks_link(text.strip()):
        text = imported(text.strip()).text
    elif suffix_of(name) not in ("", ".toml"):
        text = imported(text, name).text
    return Drawing.of(text, drawing.folder)


_OPERATIONS: dict[str, Callable[[Pen, OperationArguments], None]] = {
    "bar": bar,
    "point": point,
    "ground": ground,
    "pin": pin,
    "motor": motor,
    "slider": slider,
    "slot": slot,
    "cylinder": cylinder,
    "gear": gear,
    "cam": cam,
    "spring": spring,
    "force": force,
    "interest": interest,
    "move": move,
    "length": length,
    "set": set_value,
    "values": set_numbers,
    "name": lambda pen, values: pen.put(("name",), values.text("name")),
    "units": lambda pen, values: pen.put(("units", "length"), values.text("length")),
    "edit": edit,
}
_WHOLE: dict[str, Callable[[Drawing, OperationArguments], Drawing]] = {  # of the text, not only of its tables
    "rename": rename,
    "delete": delete,
    "replace": _replace,
}


def changed(drawing: Drawing, operations: object) -> Drawing:
    """Return a drawing after operations, one after the other.

    Args:
        drawing: The drawing; it stays as it is.
        operations: A list of JSON objects with the key "do".

    Raises:
        MechanismError: An operation is not known or not possible; the message is one line.

    """
    if not isinstance(operations, list) or len(operations) > MOST_OPERATIONS:
        raise MechanismError(f"operations must be a list of at most {MOST_OPERATIONS} operations")
    for operation in operations:
        drawing = _after(drawing, operation)
    return drawing


def _after(drawing: Drawing, operation: object) -> Drawing:
    if not isinstance(operation, dict) or not isinstance(operation.get("do"), str):
        raise MechanismError(f"{quoted(operation)} is not an operation: an object with the key 'do'")
    values, name = OperationArguments(operation), operation["do"]
    if name in _WHOLE:
        found = _WHOLE[name](drawing, values)
        values.finish()
        return found
    if name not in _OPERATIONS:
        known = [*_OPERATIONS, *_WHOLE]
        raise MechanismError(f"operation {quoted(name)} is not known{suggestion(name, known)}; known: {listed(known)}")
    pen = Pen(drawing)
    _OPERATIONS[name](pen, values)
    values.finish()
    after = drawing.with_edits(pen.edits)
    if name in _THAT_MOVE:
        return after.started_at(drawing.poses)
    return after.started_as_drawn() if name == "values" else after
