"""Docstrings as reStructuredText: literal blocks for indented equations, parameters for declared keys."""

from __future__ import annotations

import inspect
from dataclasses import is_dataclass
from typing import Any

from kinfmu.mechanism.declared import keys_of

DECLARING = {"joints", "drivers", "laws", "loads", "quantities", "measures"}  # in `mechanism`: classes declare keys


def prepared(_app: Any, _what: str, _name: str, thing: Any, _options: Any, lines: list[str]) -> None:
    """Rewrite the lines of a docstring (an autodoc event)."""
    lines[:] = _with_literal_blocks(lines)
    if inspect.isclass(thing) and not any(line.startswith(("Args:", "Attributes:")) for line in lines):
        lines += _parameters(thing)


def _with_literal_blocks(lines: list[str]) -> list[str]:
    """Put `::` before every block that is indented by four blanks or more after a paragraph."""
    result: list[str] = []
    for number, line in enumerate(lines):
        starts = line.startswith("    ") and number > 0 and not lines[number - 1].strip()
        before = next((text for text in reversed(result) if text.strip()), "")
        if starts and before and not before.startswith((" ", "..", ":", "-", "*")):
            result += ["::", ""]
        result.append(line)
    return result


def declares_keys(cls: type) -> bool:
    """Return True for joints, drivers, laws, loads, quantities and measures."""
    return not DECLARING.isdisjoint(cls.__module__.split(".")[1:3])


def _parameters(cls: type) -> list[str]:
    """Return the declared keys of a joint, driver, law, load or measure as parameters; none for other classes."""
    if not is_dataclass(cls) or not declares_keys(cls):
        return []
    return ["", *(f":param {key.name}: {key.meaning}" for key in keys_of(cls)), ""]
