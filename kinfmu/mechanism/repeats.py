"""Repeated parts of a mechanism file: the tables of [repeat.NAME], read once for each whole number of a range.

    [counts]
    stages = 3

    [repeat.k]                                          # for k = 1, 2, 3
    to = "stages"
    bodies."left_{k}".points = { A = [0, 0], C = ["bar", 0] }

    [repeat.j]                                          # for j = 2, 3
    from = 2
    to = "stages"
    joints."A_{j}" = { type = "revolute", between = ["right_{j-1}.D", "left_{j}.A"] }

Braces in names and texts hold such a number, or one plus or minus a whole number: `{k}`, `{j-1}`, `{stages}`. The
result is an ordinary document: `left_1`, `left_2`, ... are bodies like all others.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from kinfmu.errors import MechanismError, valid_names
from kinfmu.mechanism.toml_document import check_keys, named_tables, named_values
from kinfmu.mechanism.valid import quoted

COUNTS, REPEAT = "counts", "repeat"
REPEATED = ("parameters", "bodies", "joints", "drivers", "loads", "points", "measures")
LARGEST_COUNT = 10_000
LARGEST_DOCUMENT = 4_000_000  # values and characters of names and texts, as many as a file has at most
_BRACES = re.compile(r"\{([^{}]*)\}")
_NUMBER = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:([+-])\s*([0-9]{1,5}))?\s*", re.ASCII)


def expanded(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document with the tables of [repeat.NAME] in place and numbers in place of braces.

    A document without [counts] and [repeat] is returned unchanged: braces have no meaning in it. Raise a MechanismError
    if a count, a range or a text in braces is invalid, or two copies define the same name.
    """
    if COUNTS not in document and REPEAT not in document:
        return dict(document)
    counts = {name: _count(f"[{COUNTS}] {name}", value, {}) for name, value in named_values(document, COUNTS)}
    others = {name: value for name, value in document.items() if name not in (COUNTS, REPEAT)}
    budget = _Budget()
    found: dict[str, Any] = _filled("", others, counts, budget)
    for name, table in named_tables(document, REPEAT):
        where = f"[{REPEAT}.{name}]"
        if name in counts:
            raise MechanismError(f"{where}: '{name}' is the name of a count; use another name")
        check_keys(where, table, ("from", "to", *REPEATED))
        if "to" not in table:
            raise MechanismError(f"{where} needs the key 'to', the last number, such as to = 4")
        first = _count(f"{where} from", table.get("from", 1), counts)
        last = _count(f"{where} to", table["to"], counts)
        if last < first - 1:
            raise MechanismError(f"{where} to = {last} is below from = {first}")
        tables = {key: value for key, value in table.items() if key in REPEATED}
        for key, value in tables.items():
            if not isinstance(value, dict):
                raise MechanismError(f"{where} {key} = {quoted(value)} must be a table [{REPEAT}.{name}.{key}]")
        for number in range(first, last + 1):
            copy = _filled("", tables, counts | {name: number}, budget)
            _merge(f"{where}, {name} = {number}:", "", found, copy, f"{{{name}}}")
    return found


class _Budget:
    """What is left of the size of a document; a small file may ask for ten thousand copies of a large table."""

    def __init__(self) -> None:
        self.left = LARGEST_DOCUMENT

    def take(self, size: int) -> None:
        self.left -= size
        if self.left < 0:
            raise MechanismError(f"[{REPEAT}]: too many copies; together they exceed {LARGEST_DOCUMENT} characters")


def _count(where: str, value: object, counts: Mapping[str, int]) -> int:
    """Return a whole number from 0 to LARGEST_COUNT, given as a number or as text such as 'stages - 1'."""
    number = value
    if isinstance(value, str):
        if not counts:
            raise MechanismError(f"{where} = {quoted(value)} must be a whole number")
        number = _sum(value, counts)
        if number is None:
            valid = f"a whole number or a count, such as '{next(iter(counts))}'"
            raise MechanismError(f"{where} = {quoted(value)} must be {valid}{valid_names(value, counts, 'counts')}")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number <= LARGEST_COUNT:
        raise MechanismError(f"{where} = {quoted(value)} must be a whole number from 0 to {LARGEST_COUNT}")
    return number


def _sum(text: str, numbers: Mapping[str, int]) -> int | None:
    """Return the number of 'k', 'k+1' or 'stages - 1'; None for other text."""
    match = _NUMBER.fullmatch(text)
    if not match or match[1] not in numbers:
        return None
    return numbers[match[1]] + int(f"{match[2]}{match[3]}" if match[2] else 0)


def _filled(where: str, value: Any, numbers: Mapping[str, int], budget: _Budget) -> Any:
    """Return a value with numbers in place of braces, in all its names and texts."""
    budget.take(1 + (len(value) if isinstance(value, str) else 0))
    if isinstance(value, str):
        return _text(where, value, numbers)
    if isinstance(value, list):
        return [_filled(where, one, numbers, budget) for one in value]
    if not isinstance(value, dict):
        return value
    table: dict[str, Any] = {}
    for key, one in value.items():
        budget.take(len(key))
        name = _text(f"[{where}]" if where else "the file", key, numbers)
        if name in table:
            raise MechanismError(f"[{where}] {name} is there twice, the second time as {quoted(key)}")
        table[name] = _filled(f"{where}.{name}" if where else name, one, numbers, budget)
    return table


def _text(where: str, text: str, numbers: Mapping[str, int]) -> str:
    def number(match: re.Match[str]) -> str:
        value = _sum(match[1], numbers)
        if value is None:
            raise MechanismError(
                f"{where}: {quoted(match[0])} is not a count or the number of a repeat, such as '{{k}}' or "
                f"'{{k+1}}'{valid_names(match[1], numbers, 'known here')}"
            )
        if value < 0:
            raise MechanismError(f"{where}: {quoted(match[0])} is {value}, and names cannot hold a minus sign")
        return str(value)

    return _BRACES.sub(number, text) if "{" in text else text


def _merge(where: str, table: str, target: dict[str, Any], more: Mapping[str, Any], braces: str) -> None:
    """Put the tables of a copy into those that are there; a name that is there already is an error."""
    for key, value in more.items():
        place = f"{table}.{key}" if table else key
        if key not in target:
            target[key] = value
        elif isinstance(target[key], dict) and isinstance(value, dict):
            _merge(where, place, target[key], value, braces)
        else:
            raise MechanismError(
                f"{where} {place} is there already; a repeated name needs its number, such as '{key}_{braces}'"
            )
