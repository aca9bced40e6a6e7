"""The keys of tables in mechanism files, from the annotations of the classes of joints, drivers, measures and laws.

The reader, the checks, the JSON Schema and the documentation all use this list. An annotation holds what a number
measures or what a text refers to, and the meaning of the key as text:

    axis: Annotated[Radians, "direction of the line in i's frame [rad]"] = 0.0
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from kinfmu.mechanism.laws import Law, LawQuantity, Segment
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.units import Quantity

Takes = Literal["number", "text", "pair", "truth", "numbers", "points", "segments", "measure", "measured", "law"]
REQUIRED = MISSING
_PLAIN: dict[Any, Takes] = {
    bool: "truth",
    Law: "law",
    PoseQuantity: "measure",
    PoseQuantity | None: "measure",
    str | PoseQuantity: "measured",
    tuple[float, ...]: "numbers",
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
    keys = [field for field in fields(cls) if field.name != "name" and not field.metadata.get("internal")]
    return tuple(_key(cls, field, hints[field.name]) for field in keys)


def _key(cls: Any, field: Any, hint: Any) -> Key:
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
        raise NotImplementedError(f"{cls.__name__}.{field.name}: {base} is not a type that a mechanism file can hold")
    return Key(field.name, takes, measures, refers, REQUIRED if takes == "law" else field.default, meaning)


def summary_of(cls: type) -> str:
    """Return the first line of the docstring, without its full stop."""
    return (cls.__doc__ or "").strip().partition("\n")[0].rstrip(".:")
