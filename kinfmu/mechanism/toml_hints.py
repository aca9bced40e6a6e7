"""Errors of TOML text in the words of a mechanism file: the line, and what to write in its place."""

from __future__ import annotations

import re

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


def explained(text: str, error: ValueError) -> str:
    """Return the message of an error of tomllib with the line's content and what to write, where that is known.

    Args:
        text: The whole text.
        error: As `tomllib.loads` raises it.

    Returns:
        One line, to follow 'not valid TOML: '.

    """
    found = _PLACE.match(str(error))
    lines = text.replace("\t", " ").split("\n")
    if found is None or not 0 < int(found["line"]) <= len(lines):
        return str(error)
    number = int(found["line"])
    line = lines[number - 1].strip()
    if not "".join(lines[:number]).isprintable():  # a control character, whose code tomllib states
        return str(error)
    if _TWICE.match(found["what"]):
        return f"line {number}: {_twice(lines, number)}"
    for pattern, rule, cure in _HINTS:
        wrong = re.search(pattern, line)
        if wrong and not _is_quoted(line, wrong.start("value")):
            blanks = {"key": wrong["key"], "value": wrong["value"].strip(), "small": wrong["value"].lower()}
            blanks["point"] = blanks["value"].replace(",", ".")
            return f"line {number}: {_shown(wrong[0].strip())}: {rule}: {cure.format(**blanks)}"
    return str(error)


def _twice(lines: list[str], number: int) -> str:
    """Return what the line `number` writes for the second time, with the line of the first."""
    table, name = _written(lines, number)
    if not name:
        return f"{table} is written twice"
    full = ".".join(filter(None, (table, name)))
    first = next((k for k in range(1, number) if ".".join(filter(None, _written(lines, k))) == full), None)
    if first is None and (found := _given_above(lines, number, full)):
        parent, line = found
        if re.match(rf" *{_KEY} *\{{", lines[line - 1]):
            key = full.removeprefix(f"{parent}.")
            return f"'{parent}' is a table in braces in line {line}: write {key} = ... inside the braces"
        return f"'{full}': '{parent}' has a value in line {line}, so it is not a table"
    return f"'{full}' is written twice" + (f", first in line {first}" if first else "") + "; keep one"


def _given_above(lines: list[str], number: int, full: str) -> tuple[str, int] | None:
    """Return the key above the line `number` that a name extends, such as 'a' of 'a.b', and its line; None: no such."""
    parents = {full[:k] for k, sign in enumerate(full) if sign == "."}
    for k in range(1, number):
        name = ".".join(filter(None, _written(lines, k)))
        if name in parents and not _HEADER.match(lines[k - 1]):
            return name, k
    return None


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


def _shown(line: str) -> str:
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}..."
