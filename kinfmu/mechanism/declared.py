"""The keys of tables in mechanism files, from the annotations of the classes of bodies, joints, measures and so on.

The reader, the checks, the JSON Schema and the documentation all use this list. An annotation holds what a number
measures or what a text refers to, and the meaning of the key as text:

    axis: Annotated[Radians, "direction of the line in i's frame [rad]"] = 0.0
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from kinfmu.mechanism.body import Point
from kinfmu.mechanism.laws import Law, LawQuantity, Segment
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.units import Quantity

Takes = Literal[
    "number", "text", "pair", "truth", "numbers", "place", "points", "ends", "corners", "segments", "measure",
    "measured", "law",
]  # fmt: skip
REQUIRED = MISSING
_PLAIN: dict[Any, Takes] = {
    bool: "truth",
    Law: "law",
    PoseQuantity: "measure",
    PoseQuantity | None: "measure",
    str | PoseQuantity: "measured",
    tuple[float, ...]: "numbers",
    Point: "place",
    tuple[str, str] | None: "ends",  # names of points of the body
    tuple[str, ...] | None: "corners",
    tuple[tuple[float, float], ...]: "points",
    tuple[Segment, ...]: "segments",
}


class Key(NamedTuple):
    """A key of a table."""

    name: str
    takes: Takes  # the shape of its value
    measures: Quantity | LawQuantity | None  # of a number
    refers: Reference | None  # of a text, or of both texts of a pair
    default: Any  # REQUIRED if there is none
    meaning: str


@cache
def keys_of(cls: Any) -> tuple[Key, ...]:
    """Return the keys that a class declares, without `type`, `name` and internal fields, in the order of its fields."""
    hints = get_type_hints(cls, include_extras=True)
    if is_dataclass(cls):
        defaults = {one.name: one.default for one in fields(cls) if not one.metadata.get("internal")}
    else:
        defaults = {name: cls._field_defaults.get(name, REQUIRED) for name in cls._fields}
    return tuple(_key(cls, name, default, hints[name]) for name, default in defaults.items() if name != "name")


def _key(cls: Any, name: str, default: Any, hint: Any) -> Key:
    annotated = get_origin(hint) is Annotated
    base, metadata = (get_args(hint)[0], hint.__metadata__) if annotated else (hint, ())
    measures = next((one for one in metadata if isinstance(one, Quantity | LawQuantity)), None)
    refers = next((one for one in metadata if isinstance(one, Reference)), None)
    meaning = next((one for one in metadata if isinstance(one, str)), "")
    takes: Takes
    if measures is not None:
        takes = "number"
    elif refers is not None:
        takes = "pair" if get_origin(base) is tuple else "text"
    elif base in _PLAIN:
        takes = _PLAIN[base]
    else:
        raise NotImplementedError(f"{cls.__name__}.{name}: {base} is not a type that a mechanism file can hold")
    return Key(name, takes, measures, refers, REQUIRED if takes == "law" else default, meaning)


@cache
def quantities_of(cls: Any) -> Mapping[str, Quantity]:
    """Return the quantities of the numbers of a class, by key."""
    return {key.name: key.measures for key in keys_of(cls) if isinstance(key.measures, Quantity)}


def summary_of(cls: type) -> str:
    """Return the first line of the docstring, without its full stop."""
    return (cls.__doc__ or "").strip().partition("\n")[0].rstrip(".:")
