"""What the classes of joints, drivers, laws and measures declare as keys of their tables, for schema and documentation.

The reader takes the same annotations; what a key means is said once, in the docstring of its class.
"""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from typing import Any, Literal, NamedTuple, get_args, get_type_hints

from kinfmu.laws import Law, LawQuantity, Segment
from kinfmu.measures import Measure
from kinfmu.measures.placement import Reference
from kinfmu.units import Quantity

Takes = Literal["number", "text", "pair", "truth", "numbers", "points", "segments", "measure", "law"]
REQUIRED = MISSING


class Key(NamedTuple):
    """A key of a table.

    takes: the shape of its value; measures: of a number, what it measures; refers: of text or of a pair of texts, to
    what; default: REQUIRED if there is none; meaning: in words.
    """

    name: str
    takes: Takes
    measures: Quantity | LawQuantity | None
    refers: Reference | None
    default: Any
    meaning: str


def keys_of(cls: type) -> tuple[Key, ...]:
    """The keys that a class declares, without `type` and `name`, in the order of its fields."""
    hints = get_type_hints(cls, include_extras=True)
    found = []
    for field in fields(cls):
        if field.name == "name":
            continue
        hint = hints[field.name]
        said = getattr(hint, "__metadata__", ())
        measures = next((one for one in said if isinstance(one, Quantity | LawQuantity)), None)
        refers = next((one for one in said if isinstance(one, Reference)), None)
        takes = _takes(cls, field.name, hint, measures, refers)
        default = REQUIRED if takes == "law" else field.default
        found.append(Key(field.name, takes, measures, refers, default, meaning_of(cls, field.name)))
    return tuple(found)


def _takes(cls: type, key: str, hint: Any, measures: object, refers: Reference | None) -> Takes:
    if measures is not None:
        return "number"
    if refers is not None:
        return "pair" if getattr(hint.__origin__, "__origin__", None) is tuple else "text"
    if hint is bool:
        return "truth"
    if isinstance(hint, type) and issubclass(hint, Law):
        return "law"
    if isinstance(hint, type) and issubclass(hint, Measure):
        return "measure"
    items: dict[Any, Takes] = {float: "numbers", tuple[float, float]: "points", Segment: "segments"}
    item = next(iter(get_args(hint)), None)
    if item not in items:
        raise NotImplementedError(f"{cls.__name__}.{key}: {hint} is no key that a mechanism file can hold")
    return items[item]


def meaning_of(cls: type, key: str) -> str:
    """What the docstring of the class, or of one it is derived from, says after 'key: ' below its first line."""
    pattern = re.compile(rf"(?<![\w.'])(?:\w+, )*{key}(?:, \w+)*: (.*?)(?=; (?:\w+, )*\w+: |\.(?: [A-Z]|$))")
    for base in cls.__mro__:
        _, _, body = (base.__doc__ or "").partition("\n\n")
        found = pattern.search(" ".join(body.split()))
        if found:
            return found[1]
    return ""


def summary_of(cls: type) -> str:
    """The first line of the docstring, without its full stop."""
    return (cls.__doc__ or "").strip().partition("\n")[0].rstrip(".:")
