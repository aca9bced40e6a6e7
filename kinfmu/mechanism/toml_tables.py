"""Tables of a TOML document; messages about unknown, missing or wrong values state the place and what is valid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.laws import Spline
from kinfmu.mechanism.valid import check_name, quoted

_OWN_KEYS = {  # keys by which files that name a mechanism differ
    "fit": {"over", "unknowns", "targets", "constraints"},
    "study": {"sampling", "designs", "seed", "report", "parameters", "measures", "run"},
}


def table_keys(cls: type) -> list[str]:
    """Return the names of the keys of a joint, driver, load, measure or law; points of a spline can be in a `file`."""
    return [key.name for key in keys_of(cls)] + (["file"] if cls is Spline else [])


def class_of_type(where: str, table: Mapping[str, Any], key: str, classes: Iterable[Any]) -> Any:
    """Return the class whose `type` is the value of `key`."""
    known = {cls.type: cls for cls in classes}
    if key not in table:
        raise MechanismError(f"{where} needs the key '{key}', one of {listed(known)}")
    word = text_of(f"{where} {key}", table[key], f"one of {listed(known)}")
    if word not in known:
        raise MechanismError(
            f"{where} {key} = {quoted(word)} is not known{suggestion(word, known)}; known: {listed(known)}"
        )
    return known[word]


def check_keys(where: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raise a MechanismError for a key that is not known; where: empty for the document itself."""
    known = list(known)
    for key in table:
        if key not in known:
            shown = key if key.isidentifier() and len(key) < 100 else quoted(key)
            place = f"{where} {shown}" if where else f"[{shown}]" if isinstance(table[key], dict) else shown
            raise MechanismError(f"{place}: unknown key{suggestion(key, known)}; keys: {listed(known)}")


def refuse_other_kind(document: Mapping[str, Any], kind: str, keys: Iterable[str]) -> None:
    """Raise a MechanismError for the document of another kind of file than `kind`: 'mechanism', 'study' or 'fit'."""
    if "bodies" in document and "mechanism" not in document and kind != "mechanism":
        raise MechanismError(
            f"this is a mechanism file; a {kind} file names it, such as mechanism = 'fourbar.toml'; keys: "
            f"{listed(keys)}"
        )
    if "mechanism" in document and "bodies" not in document:
        kinds = [other for other, own in _OWN_KEYS.items() if own.intersection(document)]
        other = kinds[0] if len(kinds) == 1 else "study" if kind == "mechanism" else kind
        if other != kind:
            raise MechanismError(f"this is a {other} file, not a {kind} file; the command is 'kinfmu {other}'")


def table_of(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the table [name], empty if it is missing."""
    table = document.get(name, {})
    if isinstance(table, list) and table and all(isinstance(one, dict) for one in table):
        raise MechanismError(f"[[{name}]] must be tables with names of their own, such as [{name}.A]")
    if not isinstance(table, dict):
        raise MechanismError(f"{name} = {quoted(table)} must be a table [{name}]")
    return table


def named_values(document: Mapping[str, Any], name: str) -> Iterable[tuple[str, Any]]:
    """Yield the keys and values of the table [name]; the keys are checked as names."""
    for key, value in table_of(document, name).items():
        check_name(f"[{name}]", key)
        yield key, value


def named_tables(document: Mapping[str, Any], name: str) -> Iterable[tuple[str, dict[str, Any]]]:
    """Yield the tables [name.KEY]."""
    for key, table in named_values(document, name):
        if not isinstance(table, dict):
            raise MechanismError(f"[{name}] {key} = {quoted(table)} must be a table [{name}.{key}]")
        yield key, table


def subtable(where: str, table: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return the table under a key, points or a start pose, empty if it is missing."""
    value = table.get(key, {})
    if not isinstance(value, dict):
        example = "{ P = [1, 0] }" if key == "points" else "{ x = 0, y = 0, phi = 0 }"
        raise MechanismError(f"{where} {key} = {quoted(value)} must be a table such as {example}")
    return value


def text_of(where: str, value: object, valid: str = "text") -> str:
    """Return the value, which must be text; `valid` describes it in the message."""
    if not isinstance(value, str):
        raise MechanismError(f"{where} = {quoted(value)} must be {valid}")
    return value
