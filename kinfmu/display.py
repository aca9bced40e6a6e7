"""Values that show themselves in notebooks; their tables, and reports of verdicts and tables, as HTML and as text."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import singledispatch
from html import escape
from importlib import import_module
from textwrap import wrap
from typing import Any, NamedTuple

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
_NUMBER = "text-align: right; vertical-align: top; white-space: nowrap"


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
    lines = ["".join(_cell("th", name) for name in header)] if header else []
    for row in rows:
        kinds = ["td" if header or number else "th" for number in range(len(row))]
        lines.append("".join(map(_cell, kinds, row)))
    return _rows_html(lines)


def page(title: str, *parts: str) -> str:
    """Return a title above parts that are HTML; empty parts are left out."""
    return f"<div><p><strong>{escaped(title)}</strong></p>{''.join(part for part in parts if part)}</div>"


def _cell(kind: str, value: object) -> str:
    is_number = isinstance(value, int | float)
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return _tag(kind, text, _NUMBER if is_number else _CELL)


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


class Verdict(NamedTuple):
    """A statement about a mechanism.

    level: 'ok', 'note', 'poor', 'problem' or 'advice'; lines: shown below the text as they are, such as TOML.
    """

    level: str
    text: str
    lines: tuple[str, ...] = ()


class Poor(str):
    """A cell of a table with a poor value."""

    __slots__ = ()


class Table(NamedTuple):
    """A table of texts; left: number of columns that are aligned to the left; caption: '' without one."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left: int = 1
    caption: str = ""


class Styled(NamedTuple):
    """A part of a line; style: a level of verdicts, 'title', 'faint' or ''."""

    style: str
    text: str


COLOURS = {"ok": "#1a7f37", "note": "#0969da", "advice": "#0969da", "poor": "#cf222e", "problem": "#cf222e"}
_CODES = {"ok": "32", "note": "36", "advice": "36", "poor": "31", "problem": "1;31", "title": "1", "faint": "90"}
_GAP = 2  # letters between columns
_SHORT = 16  # letters that stay of a long name in a narrow table
_LONG = re.compile(r"\w{20,}")  # names that may break on a page
_INSIDE = re.compile(r" (?== )|(?<= =) |(?<=\d) (?=[A-Za-z])")  # blanks at which no line ends


class Summary(NamedTuple):
    """A report on a mechanism, from which texts, pages and sheets are painted; title: '' without one."""

    name: str
    title: str
    verdicts: tuple[Verdict, ...]
    tables: tuple[Table, ...]

    def text(self, width: int, *, colour: bool = False) -> str:
        """Return the report as text for a terminal of a width [letters]; colour: with codes of colours."""
        lines = ([terminal(part) if colour else part.text for part in line] for line in self.lines(width))
        return "\n".join("".join(line).rstrip() for line in lines)

    def lines(self, width: int) -> Iterator[list[Styled]]:
        """Yield the lines of the report; longer than `width` are only words that are longer."""
        *head, last = wrapped(self.title or self.name, width - len(self.name) - _GAP)
        yield from ([Styled("title", line)] for line in head)
        yield [Styled("title", last), Styled("faint", f"{'':{_GAP}}{self.name}" if self.title else "")]
        yield []
        indent = 4 + max((len(verdict.level) for verdict in self.verdicts), default=0)
        for level, text, below in self.verdicts:
            first, *others = wrapped(text, width - indent)
            yield [Styled(level, f"  {level}".ljust(indent)), Styled("", first)]
            yield from ([Styled("", " " * indent + line)] for line in (*others, *(f"  {line}" for line in below)))
        for table in self.tables:
            yield []
            lines = [*_table_lines(table, width - indent, width - 2)]
            left = min(indent, max(width - max(sum(len(part.text) for part in line) for line in lines), 2))
            yield from ([Styled("", " " * left), *line] for line in lines)

    def html(self) -> str:
        """Return verdicts and tables as HTML."""
        rows = []
        for level, text, below in self.verdicts:
            shown = _tag("td", "\n".join((text, *below)), f"{_CELL}; overflow-wrap: anywhere")
            rows.append(_tag("th", level, f"{_CELL}; color: {COLOURS[level]}", level) + shown)
        tables = [
            f"<p>{escaped(table.caption)}</p>" * bool(table.caption) + _html_table(table) for table in self.tables
        ]
        return "".join([_rows_html(rows), *tables])


def terminal(part: Styled) -> str:
    """Return a part of a line with its colour, for a terminal."""
    return f"\x1b[{_CODES[part.style]}m{part.text}\x1b[0m" if part.style and part.text.strip() else part.text


def shortened(word: str, most: int) -> str:
    """Return a word of at most so many letters, with an ellipsis in its middle if it is longer."""
    if len(word) <= most:
        return word
    head = most // 2
    return f"{word[:head]}\N{HORIZONTAL ELLIPSIS}{word[len(word) - (most - head - 1) :]}"


def wrapped(text: str, width: int, indent: str = "") -> list[str]:
    """Return text as lines of whole words; indent: begin of all lines but the first. 'u = 60 deg' is one word."""
    glued = _INSIDE.sub("\0", text)
    lines = wrap(glued, max(width, 1), subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return [line.replace("\0", " ") for line in lines] or [""]


def _table_lines(table: Table, width: int, most: int) -> Iterator[list[Styled]]:
    """Yield the lines of a table; wider than `width`, its widest columns break between words.

    Wider than `most` even then, its long names are shortened.
    """
    if table.caption:
        yield from ([Styled("title", line)] for line in wrapped(table.caption, width))
    every = (table.columns, *table.rows)
    widths = [max(map(len, column)) for column in zip(*every, strict=True)]
    least = []
    for k, (head, *cells) in enumerate(zip(*every, strict=True)):
        is_text = k < table.left
        words = [f"{word}{'  '}" for cell in cells for word in _INSIDE.sub("_", cell).split()] if is_text else cells
        least.append(max(map(len, (*head.split(), *words)), default=0))
    full, short = [*widths], [min(letters, _SHORT) if k < table.left else letters for k, letters in enumerate(least)]
    for lowest, target in ((least, width), (short, most)):  # names of many letters are shortened last
        for _ in range(sum(widths) + _GAP * (len(widths) - 1) - target):
            k = max(range(len(widths)), key=lambda k: (widths[k] > lowest[k], widths[k]))
            widths[k] -= widths[k] > lowest[k]
    is_short = [now < min(had, letters) for now, had, letters in zip(widths, full, least, strict=True)]
    for number, row in enumerate(every):
        indents = ["  " * (number > 0 and k < table.left) for k in range(len(row))]
        cells = [
            " ".join(shortened(word, letters - 2) for word in cell.split(" ")) if is_cut else cell
            for cell, letters, is_cut in zip(row, widths, is_short, strict=True)
        ]
        parts = [*map(wrapped, cells, widths, indents)]
        for line in range(max(map(len, parts))):
            shown = []
            for k, (cell, width, lines) in enumerate(zip(row, widths, parts, strict=True)):
                text = lines[line] if line < len(lines) else ""
                style = "faint" if number == 0 else "poor" if isinstance(cell, Poor) else ""
                text = text.ljust(width) if k < table.left else text.rjust(width)
                shown += [Styled("", " " * _GAP * (k > 0)), Styled(style, text)]
            yield [*shown[:-1], Styled(style, text.rstrip())]


def _html_table(table: Table) -> str:
    """Return a table as HTML."""
    styles = [_CELL if k < table.left else _NUMBER for k in range(len(table.columns))]
    rows = ["".join(map(_tag, ["th"] * len(styles), table.columns, styles))]
    for row in table.rows:
        poor = [f"; color: {COLOURS['poor']}" if isinstance(cell, Poor) else "" for cell in row]
        cells = zip(row, styles, poor, strict=True)
        rows.append("".join(_tag("td", cell, style + more, "poor" if more else "") for cell, style, more in cells))
    return _LONG.sub(lambda name: name[0].replace("_", "_<wbr>"), _rows_html(rows))


def _tag(kind: str, text: str, style: str, name: str = "") -> str:
    """Return a cell of a table; name: of its class."""
    return f'<{kind}{f" class={name}" if name else ""} style="{style}">{escaped(text)}</{kind}>'


def _rows_html(rows: Iterable[str]) -> str:
    return f'<table style="{_TABLE}">{"".join(f"<tr>{row}</tr>" for row in rows)}</table>'
