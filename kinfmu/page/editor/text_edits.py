"""Edits of the text of a mechanism file; comments, order and the writing of all other values stay."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from kinfmu.errors import MechanismError
from kinfmu.mechanism.edits import Edit, Place, Put, apply, edited

_OF_TABLES = ("bodies", "drivers", "loads", "measures")  # a member of these is a table of its own


def edited_text(text: str, document: Mapping[str, Any], edits: Iterable[Edit]) -> str:
    """Return the text of a file with edits made one after the other.

    Args:
        text: The text.
        document: Its tables.
        edits: The edits.

    Raises:
        MechanismError: An edit is not possible, or not without writing more of the text anew.

    """
    edits = list(edits)
    wanted = edited(document, edits)

    def edit(written: Any, of_tables: tuple[str, ...]) -> None:
        for one in edits:
            apply(written, Put(one.place, _item(one.place, one.value, of_tables)) if isinstance(one, Put) else one)

    try:
        return _rewritten(text, wanted, lambda written: edit(written, _OF_TABLES))
    except MechanismError:  # a file may have tables such as [joints.A], after which no line of [joints] can be
        return _rewritten(text, wanted, lambda written: edit(written, (*_OF_TABLES, "joints")))


def renamed_text(text: str, document: Mapping[str, Any], place: Place, name: str) -> str:
    """Return the text with another name for the last key of a place, which stays where it is in the file.

    Raises:
        MechanismError: It is not possible without writing more of the text anew.

    """
    *tables, last = place
    wanted = edited(document, ())
    inner: Any = wanted
    for key in tables:
        inner = inner[key]
    inner[name] = inner.pop(last)

    def rename(written: Any) -> None:
        table = written
        for key in tables:
            table = table[key]
        item = table.item(last) if hasattr(table, "item") else table[last]
        if getattr(item, "display_name", None) is not None:
            item.display_name = None
        table.value._replace(last, tomlkit.key(name), item)  # no other way keeps the place

    return _rewritten(text, wanted, rename)


def _rewritten(text: str, wanted: Mapping[str, Any], edit: Callable[[Any], None]) -> str:
    """Return the text after an edit of it as a document of tomlkit; it must then hold the wanted tables."""
    found, is_as_wanted = text, False
    try:
        written = tomlkit.parse(text)
        edit(written)
        found = tomlkit.dumps(written)
        is_as_wanted = tomllib.loads(found) == wanted
    except (TOMLKitError, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        pass
    if not is_as_wanted:
        raise MechanismError("this change cannot be written into the file as it is written; change its text")
    return found


def _item(place: Place, value: Any, of_tables: tuple[str, ...]) -> Any:
    """Return a value as it is written at a place: members of most tables as tables, what is in them on one line."""
    if isinstance(value, Mapping):
        is_table = len(place) == 1 or (len(place) == 2 and place[0] in of_tables)
        table: Any = tomlkit.table() if is_table else tomlkit.inline_table()
        for key, inner in value.items():
            table.append(key, _item((*place, key), inner, of_tables))
        return table
    if isinstance(value, list | tuple):
        array = tomlkit.array()
        for inner in value:
            array.append(_item((*place, "", ""), inner, of_tables))
        return array
    return value
