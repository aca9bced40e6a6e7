"""Titles that fit over what they stand: a long one goes on in a second line, and ends in an ellipsis after that."""

from __future__ import annotations

import textwrap
from functools import lru_cache

TITLE_FONT = 11.0  # [pt]
TITLE_LINE = 15.0  # [pt], from line to line
MOST_LINES = 2
_THINNEST = 2.0  # [pt]; a line of i and l alone has no more letters than that


@lru_cache(maxsize=64)
def title_lines(title: str, room: float) -> list[str]:
    """The lines of a title, none wider than `room` [pt]; MOST_LINES at most, one if that holds it, none if it is ''."""
    title = title[: 2 * MOST_LINES * max(int(room / _THINNEST), 1)]  # what follows is in none of the lines
    for count in range(max(min(len(title), int(room / _THINNEST)), 1), 1, -1):
        lines = textwrap.wrap(title, count)
        if len(lines) > MOST_LINES:
            lines = [*lines[: MOST_LINES - 1], f"{lines[MOST_LINES - 1]}\N{HORIZONTAL ELLIPSIS}"]
        if all(_width(line) <= room for line in lines):
            return lines
    return [title] if title else []


def _width(line: str) -> float:
    """[pt]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    width: float = text_to_path.get_text_width_height_descent(line, FontProperties(size=TITLE_FONT), ismath=False)[0]
    return width
