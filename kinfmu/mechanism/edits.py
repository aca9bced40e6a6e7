"""Edits of a mechanism file: values put at places of its tables, and places removed."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.valid import quoted

Place = tuple[str, ...]  # keys of nested tables, such as ("bodies", "crank", "points", "P")


class Put(NamedTuple):
    """A value at a place; tables on the way are made if they are not there, and a value that is there is replaced.

    Attributes:
        place: Keys of nested tables.
        value: What TOML can hold: text, a number, true or false, a list, or a table as a dict.

    """

    place: Place
    value: Any


class Remove(NamedTuple):
    """A place that is removed, with all that is in it.

    Attributes:
        place: Keys of nested tables; it must be there.

    """

    place: Place


Edit = Put | Remove


def edited(document: Mapping[str, Any], edits: Iterable[Edit]) -> dict[str, Any]:
    """Return a copy of the tables of a file with edits made one after the other.

    Raises:
        MechanismError: A place to remove is not there, or a value is where a table is needed.

    """
    changed = copy.deepcopy(dict(document))
    for edit in edits:
        apply(changed, edit)
    return changed


def apply(document: dict[str, Any], edit: Edit) -> None:
    """Make one edit in the tables of a file, or in a document of tomlkit, which keeps comments and order.

    Raises:
        MechanismError: A place to remove is not there, or a value is where a table is needed.

    """
    *tables, last = edit.place
    table: Any = document
    for number, key in enumerate(tables):
        if key not in table and isinstance(edit, Put):
            table[key] = {}
        table = table.get(key)
        if not isinstance(table, dict):
            raise MechanismError(f"{'.'.join(edit.place[: number + 1])} is not a table")
    if isinstance(edit, Put):
        table[last] = edit.value
    elif last in table:
        del table[last]
    else:
        raise MechanismError(f"{quoted(last)} is not in {'.'.join(tables) or 'the file'}")
