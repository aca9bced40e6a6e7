"""Pieces of HTML: escaped text, tables, and pages of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_TABLE = "margin: 0 0 1em 0"  # tables may follow each other
_CELL = "text-align: left; vertical-align: top; white-space: pre-wrap"
_NUMBER = "text-align: right; vertical-align: top"


def escaped(text: object) -> str:
    """Return text for HTML."""
    return escape(str(text))


def table(rows: Iterable[Sequence[object]], header: Sequence[str] = ()) -> str:
    """Return a table. Text is escaped; floats are shown with six digits, on the right.

    Args:
        rows: Cells of each row.
        header: Names of the columns. Default: none; the first column then names the rows.

    Returns:
        The HTML.

    """
    lines = [f"<tr>{''.join(_cell('th', name) for name in header)}</tr>"] if header else []
    for row in rows:
        kinds = ["td" if header or number else "th" for number in range(len(row))]
        lines.append(f"<tr>{''.join(_cell(kind, value) for kind, value in zip(kinds, row, strict=True))}</tr>")
    return f'<table style="{_TABLE}">{"".join(lines)}</table>'


def page(title: str, *parts: str) -> str:
    """Return a title above parts that are HTML; empty parts are left out."""
    return f"<div><p><strong>{escaped(title)}</strong></p>{''.join(part for part in parts if part)}</div>"


def _cell(kind: str, value: object) -> str:
    is_number = isinstance(value, int | float)
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f'<{kind} style="{_NUMBER if is_number else _CELL}">{escaped(text)}</{kind}>'
