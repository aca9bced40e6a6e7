"""Edits of the text of a mechanism file; comments, order and the writing of all other values stay."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array, InlineTable

from kinfmu.errors import MechanismError
from kinfmu.mechanism.edits import Edit, Place, Put, Remove, apply, edited

_STYLES = (  # tables whose members are tables of their own; that of kinfmu first
    ("bodies", "drivers", "loads", "measures"),
    ("bodies", "drivers", "loads", "measures", "joints"),  # after [joints.A] there is no line of [joints]
    (),  # after dotted keys, and inside braces, there is no table
)
_NOT_WRITTEN = "this change cannot be written into the file as it is written; change its text"
_COMMENTED = re.compile(r"^(?P<comments>(?:#[^\n]*\n)+)(?P<header>\[[^\n]*)$", re.MULTILINE)
_CLOSE = re.compile(r"^(?P<above>[^\n#]*[^\n\s#][^\n]*\n)(?=\[)", re.MULTILINE)  # a line above a header


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
            if isinstance(one, Put) and _replaced_in_list(written, one):
                continue
            apply(written, Put(one.place, _item(one.place, one.value, of_tables)) if isinstance(one, Put) else one)
            _space(written, one.place[:-1])

    for of_tables in _STYLES:
        with suppress(MechanismError):
            return _rewritten(text, wanted, partial(edit, of_tables=of_tables))
    raise MechanismError(_NOT_WRITTEN)


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
        item = table.item(last)
        if getattr(item, "display_name", None) is not None:
            item.display_name = None
        table.value._replace(last, tomlkit.key(name), item)  # no other way keeps the place
        _space(written, tuple(tables))

    full = re.compile(rf"^([ \t]*\[?){re.escape('.'.join(place))}(?=[ \t]*[.\]=])", re.MULTILINE)
    renamed = full.sub(rf"\g<1>{'.'.join((*tables, name))}", text)  # in headers and dotted keys
    with suppress(ValueError):
        if renamed != text and tomllib.loads(renamed) == wanted:
            return renamed
    try:
        return _rewritten(text, wanted, rename)
    except MechanismError:  # at its place it is not possible
        return edited_text(text, document, [Put((*tables, name), inner[name]), Remove(place)])


def _rewritten(text: str, wanted: Mapping[str, Any], edit: Callable[[Any], None]) -> str:
    """Return the text after an edit of it as a document of tomlkit; it must then hold the wanted tables."""
    if "\r\n" in text:
        return _rewritten(text.replace("\r\n", "\n"), wanted, edit).replace("\n", "\r\n")
    try:
        written = tomlkit.parse(text)
        edit(written)
        found = tomlkit.dumps(written)
        found = _with_comments(found, text)
        for one in (_with_blank_lines(found, text), found):
            if _without_empty(tomllib.loads(one)) == _without_empty(wanted):
                return one
    except (TOMLKitError, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        pass
    raise MechanismError(_NOT_WRITTEN)


def _replaced_in_list(written: Any, edit: Put) -> bool:
    """Put new entries into a list of the same length, with its comments; return whether it is one."""
    found = written
    for key in edit.place:
        if not isinstance(found, Mapping) or key not in found:
            return False
        found = found[key]
    if not isinstance(found, Array) or not isinstance(edit.value, list) or len(found) != len(edit.value):
        return False
    for k, (old, new) in enumerate(zip(found.unwrap(), edit.value, strict=True)):
        if old != new or type(old) is not type(new):
            found[k] = tomlkit.value(_line(new))
    return True


def _without_empty(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables that are not empty; one whose last member is removed is gone from the text."""
    return {key: value for key, value in document.items() if value != {}}


def _with_comments(text: str, before: str) -> str:
    """Return the text with the comments above its headers; tomlkit removes them with the table before them."""
    for found in _COMMENTED.finditer(before):
        comments, header = found["comments"], f"\n{found['header']}"
        if found[0] in text or text.count(header) != 1:
            continue
        above, below = text.split(header)
        if above.rstrip("\n").endswith(comments.rstrip("\n")):  # with a blank line between them
            text = above.rstrip("\n") + header + below
        else:
            text = f"{above}\n{comments}{header[1:]}{below}"
    return text


def _with_blank_lines(text: str, before: str) -> str:
    """Return the text with a blank line above each header that has none and that was not like this before."""

    def spaced(found: re.Match[str]) -> str:
        header = text[found.end() :].partition("\n")[0]
        return found["above"] + ("" if found["above"] + header in before else "\n")

    return _CLOSE.sub(spaced, text)


def _space(written: Any, place: Place) -> None:
    """Write a table in braces at a place with blanks inside its braces, as the others are."""
    *tables, last = place or ("",)
    table = written
    for key in tables:
        table = table[key]
    inner = table.get(last) if last else None
    if isinstance(inner, InlineTable):
        entries = [
            f"{key.as_string().strip()} = {item.as_string()}" for key, item in inner.value.body if key is not None
        ]
        table[last] = tomlkit.value(_braces(entries))


def _braces(entries: Iterable[str]) -> str:
    inside = ", ".join(entries)
    return f"{{ {inside} }}" if inside else "{}"


def _item(place: Place, value: Any, of_tables: tuple[str, ...]) -> Any:
    """Return a value as it is written at a place: members of most tables as tables, what is in them on one line."""
    if not isinstance(value, Mapping) or not (len(place) == 1 or (len(place) == 2 and place[0] in of_tables)):
        return tomlkit.value(_line(value))
    table = tomlkit.table()
    for key, inner in value.items():
        table.append(key, _item((*place, key), inner, of_tables))
    return table


def _line(value: Any) -> str:
    """Return a value as it is written on one line."""
    if isinstance(value, Mapping):
        return _braces(f"{tomlkit.key(key).as_string()} = {_line(inner)}" for key, inner in value.items())
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_line, value))}]"
    return str(tomlkit.item(value).as_string())
