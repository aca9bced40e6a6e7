"""The part of an invalid mechanism file that can be read: its bodies and joints, and what else is valid."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.mechanism.body import MASS_KEYS
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.repeats import expanded
from kinfmu.mechanism.toml_file import document_of, mechanism_of, text_in

_MASSES = "masses"  # of bodies, which have no table of their own
_STEPS = (  # what is left out, until the rest is valid
    ("measures",),
    ("measures", "loads", "gravity", _MASSES),
    ("measures", "loads", "gravity", _MASSES, "drivers", "run", "points", "outputs"),
)


class PartialFile(NamedTuple):
    """The valid part of a mechanism file, and names of what is left out, such as '[measures]' and 'masses'."""

    mechanism: Mechanism
    left_out: tuple[str, ...]


def read_partially(path: str | Path) -> PartialFile | None:
    """Return the valid part of a mechanism file that `toml_file.read` refuses; None if bodies or joints are invalid."""
    path = Path(path)
    try:
        document = expanded(document_of(text_in(path, "a mechanism file"), str(path)))
    except MechanismError:
        return None
    for names in _STEPS:
        there = [name for name in names if name in document or (name == _MASSES and _has_masses(document))]
        try:
            mechanism = mechanism_of(_without(document, there), path.parent)
        except MechanismError:
            continue
        return PartialFile(mechanism, tuple(name if name == _MASSES else f"[{name}]" for name in there))
    return None


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
