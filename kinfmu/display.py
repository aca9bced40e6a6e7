"""Values that show themselves in notebooks; their tables as HTML and as text."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from functools import singledispatch
from html import escape
from importlib import import_module
from typing import Any

_MAKERS = "kinfmu.notebook"  # by name: it knows the classes, which know only this package


@singledispatch
def html_of(value: object) -> str | None:
    """Return a value as HTML; `kinfmu.notebook` registers a function for each class. None: as text."""
    del value
    return None


@singledispatch
def svg_of(value: object) -> str | None:
    """Return the picture of a value as SVG, registered like `html_of`. None: there is no picture."""
    del value
    return None


@singledispatch
def widget_of(value: object) -> Any:
    """Return a value as a widget of notebooks, registered like `html_of`. None: there is none."""
    del value
    return None


class Displayed:
    """A value that shows itself in notebooks, which call these methods of a cell's result.

    No method raises an error: the text in its place states the reason.
    """

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        try:
            import_module(_MAKERS)
            return html_of(self)
        except Exception as error:
            return f"<pre>{escaped(repr(self))}\ncannot be shown: {escaped(_reason(error))}</pre>"

    def _repr_svg_(self) -> str | None:
        try:
            import_module(_MAKERS)
            return svg_of(self)
        except Exception:
            return None  # the HTML states the reason


class Live(Displayed):
    """A value that notebooks show as a widget; where none can be made, as its picture and table."""

    __slots__ = ()

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        """Return the widget for Jupyter; None in a terminal, which asks as well."""
        shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
        widget = _widget(self) if getattr(shell, "kernel", None) is not None else None
        return None if widget is None else widget._repr_mimebundle_(include=include, exclude=exclude)

    def _display_(self) -> Any:
        """Return what marimo shows."""
        widget = _widget(self)
        return sys.modules["marimo"].Html(self._repr_html_() or "") if widget is None else widget


def _widget(value: object) -> Any:
    try:
        import_module(_MAKERS)
        return widget_of(value)
    except Exception:
        return None  # the HTML states what is wrong with the value


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


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


def aligned(rows: Sequence[Sequence[str]], left: int = 0, indent: str = "  ") -> list[str]:
    """Return rows as lines whose columns are as wide as their cells.

    Args:
        rows: Cells of each row.
        left: Number of columns that are aligned to the left; the others are aligned to the right.
        indent: Begin of each line.

    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(indent + "  ".join(cells).rstrip())
    return lines
