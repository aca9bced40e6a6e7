"""Reading of TOML documents and of CSV tables of two columns.

Messages about invalid text, and unknown, missing or wrong values, state the place and what is valid.
"""

from __future__ import annotations

import csv
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from kinfmu.errors import MechanismError, listed, valid_names
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.laws import Spline
from kinfmu.mechanism.valid import check_name, quoted

LARGEST_FILE = 4_000_000  # [bytes]; a chain of ten thousand links has less
DEEPEST_KEY = 50  # parts of a dotted key; the time that the standard library takes grows with their square
_MANY_DOTS = re.compile(rf"^(?:[^.\n]*+\.){{{DEEPEST_KEY}}}", re.MULTILINE)  # what a line with such a key holds
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"?+|'[^'\n]*+'?+)"""  # of a key, or a text on one line
_TOKEN = re.compile(
    r"#[^\n]*+"  # a comment
    r'|"""(?:[^"\\]++|\\.|"(?!""))*(?:"{3,5}|\Z)'  # texts on several lines
    r"|'''(?:[^']++|'(?!''))*(?:'{3,5}|\Z)"  # before 3.11.5, Python's possessive groups of alternatives fail
    rf"|(?P<deep>(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST_KEY}}})"
    rf"|(?:{_PART}[ \t]*+(?:\.[ \t]*+)?+)++"  # other keys and values
    r"""|[^\w"'#-]++""",
    re.DOTALL,
)
_OWN_KEYS = {  # keys by which files that name a mechanism differ
    "fit": {"over", "unknowns", "targets", "constraints"},
    "study": {"sampling", "designs", "seed", "report", "parameters", "measures", "run"},
}
_PLACE = re.compile(r"^(?P<what>.*?) ?\(at line (?P<line>\d+), column (?P<column>\d+)\)$", re.DOTALL)
_KEY = r"""(?P<key>[A-Za-z0-9_."'-]+) *="""
_TEXT = r"""(?P<value>(?:[+-]?[\d.]+ *(?:[*/+-] *)?)?[^\W\d][^,}\]#"'=]*)"""
_HINTS = (  # what is found in the wrong line, and what to say; the first that is found counts
    (rf"{_KEY} *(?P<value>[+-]?[0-9]+,[0-9]+)(?![\w.]|,\d)", "a decimal has a point, not a comma", "{key} = {point}"),
    (rf"{_KEY} *\((?P<value>[^()]*)\)", "a list has brackets, not parentheses", "{key} = [{value}]"),
    (rf"{_KEY} *(?P<value>True|TRUE|False|FALSE)\b", "written in small letters", "{key} = {small}"),
    (rf"{_KEY} *{_TEXT}", "text, also a number with a unit, needs quotes", '{key} = "{value}"'),
)
_TWICE = re.compile(r"^Cannot (?:overwrite a value|declare .* twice|mutate immutable namespace)")
_HEADER = re.compile(r"^ *\[+ *(?P<name>[^\[\]#]+?) *\]")
_LONGEST = 80  # characters of a line in a message
_DECIMAL = re.compile(r"\s*+[+-]?+(?:(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+|nan|inf)\s*+")


def text_in(path: Path, what: str, where: str = "") -> str:
    """Return the text of a file, or raise a MechanismError.

    what: What it should be, such as 'a mechanism file'. where: The key that names it, in messages. Default: the path.
    """
    begin, what_is = _beginning(path, where)
    try:
        return content_of(path, what, where).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MechanismError(f"{begin} {what_is}not a text file (byte {error.start} is not UTF-8)") from None


def content_of(path: Path, what: str, where: str = "") -> bytes:
    """Return the content of a file, or raise a MechanismError; arguments as of `text_in`."""
    begin, what_is = _beginning(path, where)
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # a device or a pipe has no size to ask for
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise MechanismError(f"{begin} cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(content) > LARGEST_FILE:
        raise MechanismError(f"{begin} {what_is}too large for {what} (largest: {LARGEST_FILE} bytes)")
    return content


def _beginning(path: Path, where: str) -> tuple[str, str]:
    """Return how a message begins, and what follows before an adjective."""
    return (where, "is ") if where else (f"{path}:", "")


def document_of(text: str, where: str) -> dict[str, Any]:
    """Return the tables of TOML text; a MechanismError states the line."""
    deep = _deep_key(text)
    if deep is not None:
        line = text.count("\n", 0, deep) + 1
        raise MechanismError(f"{where}: not valid: a key of more than {DEEPEST_KEY} parts (at line {line})")
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise MechanismError(f"{where}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise MechanismError(f"{where}: not valid TOML: {explained(text, error)}") from None
    except ValueError:  # Python refuses whole numbers of thousands of digits
        raise MechanismError(f"{where}: not valid TOML: a number has too many digits") from None


def _deep_key(text: str) -> int | None:
    """Return the position of the first key of more than DEEPEST_KEY parts, outside comments and texts."""
    if not _MANY_DOTS.search(text):
        return None
    return next((token.start() for token in _TOKEN.finditer(text) if token.lastgroup), None)


def table_keys(cls: type) -> list[str]:
    """Return the names of the keys of a joint, driver, load, measure or law; points of a spline can be in a `file`."""
    return [key.name for key in keys_of(cls)] + (["file"] if cls is Spline else [])


def class_of_type(where: str, table: Mapping[str, Any], key: str, classes: Iterable[Any]) -> Any:
    """Return the class whose `type` is the value of `key`."""
    by_type = {cls.type: cls for cls in classes}
    if key not in table:
        raise MechanismError(f"{where} needs the key '{key}', one of {listed(by_type)}")
    word = text_of(f"{where} {key}", table[key], f"one of {listed(by_type)}")
    if word not in by_type:
        raise MechanismError(f"{where} {key} = {quoted(word)} is not known{valid_names(word, by_type)}")
    return by_type[word]


def check_keys(where: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raise a MechanismError for a key that is not known; where: empty for the document itself."""
    known = list(known)
    for key in table:
        if key not in known:
            shown = key if key.isidentifier() and len(key) < 100 else quoted(key)
            place = f"{where} {shown}" if where else f"[{shown}]" if isinstance(table[key], dict) else shown
            raise MechanismError(f"{place}: unknown key{valid_names(key, known, 'keys')}")


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


def named_values(document: Mapping[str, Any], name: str, most_parts: int = 1) -> Iterable[tuple[str, Any]]:
    """Yield the keys and values of the table [name]; the keys are checked as names of so many parts at most."""
    for key, value in table_of(document, name).items():
        check_name(f"[{name}]", key, most_parts=most_parts)
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


def explained(text: str, error: ValueError) -> str:
    """Return the message of an error of tomllib with the line's content and what to write, where that is known.

    It is one line, to follow 'not valid TOML: '. text: The whole text. error: As `tomllib.loads` raises it.
    """
    place = _PLACE.match(str(error))
    lines = text.replace("\t", " ").split("\n")
    if place is None or not 0 < int(place["line"]) <= len(lines):
        return str(error)
    number = int(place["line"])
    line = lines[number - 1].strip()
    if not "".join(lines[:number]).isprintable():  # a control character, whose code tomllib states
        return str(error)
    if _TWICE.match(place["what"]):
        return f"line {number}: {_twice(lines, number)}"
    for pattern, rule, cure in _HINTS:
        wrong = re.search(pattern, line)
        if wrong and not _is_quoted(line, wrong.start("value")):
            blanks = {"key": wrong["key"], "value": wrong["value"].strip(), "small": wrong["value"].lower()}
            blanks["point"] = blanks["value"].replace(",", ".")
            found = wrong[0].strip()
            found = found if len(found) <= _LONGEST else f"{found[:_LONGEST]}..."
            return f"line {number}: {found}: {rule}: {cure.format(**blanks)}"
    return str(error)


def _twice(lines: list[str], number: int) -> str:
    """Return what the line `number` writes for the second time, with the line of the first."""
    table, name = _written(lines, number)
    if not name:
        return f"{table} is written twice"
    full = _full_name(lines, number)
    first = next((k for k in range(1, number) if _full_name(lines, k) == full), None)
    if first is None and (above := _parent_above(lines, number, full)):
        parent, line = above
        if re.match(rf" *{_KEY} *\{{", lines[line - 1]):
            key = full.removeprefix(f"{parent}.")
            return f"'{parent}' is a table in braces in line {line}: write {key} = ... inside the braces"
        return f"'{full}': '{parent}' has a value in line {line}, so it is not a table"
    return f"'{full}' is written twice" + (f", first in line {first}" if first else "") + "; keep one"


def _parent_above(lines: list[str], number: int, full: str) -> tuple[str, int] | None:
    """Return the key above the line `number` that a name extends, such as 'a' of 'a.b', and its line; None: no such."""
    parents = {full[:k] for k, sign in enumerate(full) if sign == "."}
    for k in range(1, number):
        name = _full_name(lines, k)
        if name in parents and not _HEADER.match(lines[k - 1]):
            return name, k
    return None


def _full_name(lines: list[str], number: int) -> str:
    """Return 'table.key' of a line, or the one of both that it has."""
    return ".".join(filter(None, _written(lines, number)))


def _written(lines: list[str], number: int) -> tuple[str, str]:
    """Return the table in which a line is and its key; of a header ('', its name)."""
    header = _HEADER.match(lines[number - 1])
    if header:
        return "", header["name"]
    key = re.match(rf" *{_KEY}", lines[number - 1])
    above = (_HEADER.match(line) for line in reversed(lines[: number - 1]))
    table = next((found["name"] for found in above if found), "")
    return table, key["key"] if key else ""


def _is_quoted(line: str, at: int) -> bool:
    """Return True if a position of a line is inside quotes or a comment."""
    quote = ""
    for sign in line[:at]:
        if quote == "#":
            return True
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'#":
            quote = sign
    return bool(quote)


def read_table(where: str, name: Any, folder: Path | None) -> tuple[tuple[Any, Any], ...]:
    """Return the rows of a CSV file of two columns, x and u, as numbers, or as text where the header gives a unit.

    The first line may be a header with units in brackets: `angle [deg], lift [mm]`. Columns are separated by commas,
    semicolons or tabs; empty lines and lines that begin with # are skipped.

    Raise a MechanismError that states file and line if the file cannot be read, or a line is wrong.

    where: The key in messages. name: Path of the file. folder: Where a relative path starts; None: files are refused.
    """
    if not isinstance(name, str):
        raise MechanismError(f"{where} = {quoted(name)} must be the name of a CSV file")
    where = f"{where} = {quoted(name)}"
    if folder is None:
        raise MechanismError(f"{where}: only a mechanism file can name a file; text needs the points themselves")
    lines = text_in(folder / name, "a table", where).splitlines()
    numbered = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    units, rows = ("", ""), []
    for place, (k, line) in enumerate(numbered):
        delimiter = next((mark for mark in ("\t", ";") if mark in line), ",")
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        except csv.Error as error:
            raise MechanismError(f"{where}, line {k}: {error}") from None
        if len(cells) != 2:
            raise MechanismError(f"{where}, line {k}: {len(cells)} columns; there must be two")
        if place == 0 and not any(map(_DECIMAL.fullmatch, cells)):
            units = (_unit(cells[0]), _unit(cells[1]))
        else:
            rows.append((_number(where, k, cells[0], units[0]), _number(where, k, cells[1], units[1])))
    return tuple(rows)


def _unit(title: str) -> str:
    """Return 'deg' of 'angle [deg]'."""
    _, bracket, unit = title.removesuffix("]").rpartition("[")
    return unit.strip() if bracket and title.endswith("]") and "]" not in unit else ""


def _number(where: str, line: int, cell: str, unit: str) -> float | str:
    try:
        number = read_decimal(cell)
    except ValueError:
        raise MechanismError(f"{where}, line {line}: {quoted(cell)} must be a number") from None
    if not math.isfinite(number):
        raise MechanismError(f"{where}, line {line}: {cell} must be a finite number")
    return f"{number!r} {unit}" if unit else number


def read_decimal(text: str) -> float:
    """Return the number of a plain decimal such as '-1.5e3', also of nan and inf.

    Raises a ValueError for other text. Python's `float` takes more: '1_000', digits of other scripts, 'Infinity'.
    """
    if not _DECIMAL.fullmatch(text):
        raise ValueError("not a plain decimal number")
    return float(text)
