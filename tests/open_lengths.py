"""Mechanisms with every length as a parameter, for tests of what lengths do to a motion."""

from __future__ import annotations

import re

from kinfmu import Mechanism
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

_NUMBER = re.compile(r"-?\d+\.\d+(e[-+]?\d+)?")


def with_open_lengths(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with parameters p0, p1, ... in place of all numbers of points, lengths and radii."""
    values: list[str] = []

    def opened(found: re.Match[str]) -> str:
        values.append(found.group())
        return f'"p{len(values) - 1}"'

    lines = []
    for line in text(mechanism).split("\n"):
        key, sign, rest = line.partition(" = ")
        is_length = key in ("points", "length", "radius", "radii") and not rest.startswith("[[")  # no table of a law
        lines.append(f"{key}{sign}{_NUMBER.sub(opened, rest)}" if is_length else line)
    head = [f'p{k} = "{value} {mechanism.length_unit}"' for k, value in enumerate(values)]
    if "[parameters]" in lines:
        at = lines.index("[parameters]") + 1
        lines[at:at] = head
    else:
        at = lines.index("[run]") if "[run]" in lines else lines.index("[bodies.ground]")
        lines[at:at] = ["[parameters]", *head, ""]
    return parse("\n".join(lines))
