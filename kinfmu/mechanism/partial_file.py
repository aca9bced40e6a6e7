"""The part of an invalid mechanism file that can be read: its bodies and joints, and what else is valid."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.body import MASS_KEYS
from kinfmu.mechanism.checks import NO_DRIVER
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.repeats import expanded
from kinfmu.mechanism.toml_file import document_of, mechanism_of, text_in

_MASSES = "masses"  # of bodies, which have no table of their own
_STEPS = (  # what is left out, until the rest is valid
    ("measures",),
    ("measures", "loads", "gravity", _MASSES),
    ("measures", "loads", "gravity", _MASSES, "drivers", "run", "points", "outputs"),
)
_FORCES = ("loads", "gravity", _MASSES)  # all or none of them where a mass or gravity is invalid
_ENTRY = re.compile(rf"(?:{re.escape(NO_DRIVER)})?" r"\[(?:(measures|drivers|loads)\.|(points)\] )([\w-]+)")
_TABLE = re.compile(rf"\[(?:bodies\.[\w-]+\] (?:{'|'.join(MASS_KEYS)})\b|(loads|gravity|run|outputs)\b)")
_MOST_ENTRIES = 20  # left out one by one


class PartialFile(NamedTuple):
    """The valid part of a mechanism file, and names of what is left out, such as '[measures.peak]' and 'masses'."""

    mechanism: Mechanism
    left_out: tuple[str, ...]


def read_partially(path: str | Path) -> PartialFile | None:
    """Return the valid part of a mechanism file that `toml_file.read` refuses; None if bodies or joints are invalid."""
    path = Path(path)
    try:
        document = expanded(document_of(text_in(path, "a mechanism file"), str(path)))
    except MechanismError:
        return None
    found = _without_entries(document, path.parent)
    if found is not None:
        return found
    for names in _STEPS:
        there = _present(document, names)
        try:
            mechanism = mechanism_of(_without(document, there), path.parent)
        except MechanismError:
            continue
        return PartialFile(mechanism, tuple(map(_title, there)))
    return None


def _without_entries(document: Mapping[str, Any], folder: Path) -> PartialFile | None:
    """Return a file without the measures, drivers, loads, points and tables that its errors name; None for others."""
    left_out: list[str] = []
    rest = dict(document)
    for _ in range(_MOST_ENTRIES):
        try:
            return PartialFile(mechanism_of(rest, folder), tuple(left_out))
        except MechanismError as problem:
            message = str(problem)
        if entry := _ENTRY.match(message):
            table, name = entry[1] or entry[2], entry[3]
            entries = rest.get(table)
            if not isinstance(entries, Mapping) or name not in entries:
                return None
            rest[table] = {key: value for key, value in entries.items() if key != name}
            left_out.append(f"[points] {name}" if table == "points" else f"[{table}.{name}]")
        elif part := _TABLE.match(message):
            names = ("run", "measures") if part[1] == "run" else ("outputs",) if part[1] == "outputs" else _FORCES
            there = _present(rest, names)
            if not there:
                return None
            rest = _without(rest, there)
            left_out += map(_title, there)
        else:
            return None
    return None


def _present(document: Mapping[str, Any], names: Collection[str]) -> list[str]:
    """Return those of the tables that a document has."""
    return [name for name in names if name in document or (name == _MASSES and _has_masses(document))]


def _title(name: str) -> str:
    return name if name == _MASSES else f"[{name}]"


def _has_masses(document: Mapping[str, Any]) -> bool:
    return any(key in body for body in _bodies(document).values() for key in MASS_KEYS)


def _bodies(document: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    bodies = document.get("bodies")
    found = bodies.items() if isinstance(bodies, Mapping) else ()
    return {name: body for name, body in found if isinstance(body, Mapping)}


def _without(document: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Return the document without some tables, and without masses if they are among the names."""
    kept = {name: table for name, table in document.items() if name not in names}
    if _MASSES in names:
        lighter = {
            name: {key: value for key, value in body.items() if key not in MASS_KEYS}
            for name, body in _bodies(document).items()
        }
        kept["bodies"] = {**document["bodies"], **lighter}
    return kept
