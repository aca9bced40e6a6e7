"""A report as a document: figure, verdicts, tables and plots on pages of a PDF; its pictures as SVG for a page."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.display import COLOURS, Styled, Summary, shortened
from kinfmu.draw.chart import HEIGHT, MOST_CURVES, WIDTH, curves, dress, numbers, raised, round_ticks, symbol
from kinfmu.draw.drawing import figure, sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.plots import Panel, Stack, moving, not_drawn, ranked, stacks_of
from kinfmu.draw.sheet import GREY, INCH, INK, ink
from kinfmu.draw.writing import svg_text, write_pdf
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.run import Run
from kinfmu.units import ForceName, degrees_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _HEIGHT = 595.0, 842.0  # [pt], A4
_EDGE = 42.0  # [pt]
_LETTERS, _LINE = 8.0, 10.5  # [pt]; size of letters, distance of lines
_LETTER = 0.6021 * _LETTERS  # [pt], width of a letter of DejaVu Sans Mono
_COLUMNS = int((_WIDTH - 2.0 * _EDGE) / _LETTER)
_DRAWING = 225.0  # [pt], height of the figure with its scale
_PANEL = 132.0  # [pt], height of a plot with its scale and names
_LEAST_PANEL = 105.0  # [pt]
_ABREAST = 2
_STILL = 1e-9  # of the driver's range; by which a coordinate that follows the driver differs from it
_LONGEST = 26  # letters of a name above a plot


def document(path: Path, summary: Summary, mechanism: Mechanism, run: Run | None) -> None:
    """Write a report with the figure of its mechanism and plots of a run as a PDF; equal reports give equal bytes.

    FigureError if the file cannot be written, MissingPackageError without matplotlib.
    """
    write_pdf(path, lambda: _pages(summary, mechanism, run))


def drawing_svg(mechanism: Mechanism) -> str:
    """Return the figure of a mechanism as SVG, without its title; of one that does not close with its gap."""

    def draw() -> Figure:
        sheet = sheet_of(instant(mechanism, with_gap=True))
        sheet.axes.set_title("", loc="left")
        return sheet.figure

    return svg_text("the figure", draw)


def plots_svg(run: Run) -> list[str]:
    """Return the plots of a run as SVG."""
    return [svg_text("the plots", partial(_plot, run, panels)) for panels in _groups(run)]


def plots_note(run: Run) -> str:
    """Return a line that names the coordinates without a curve in the plots; '' without any."""
    return not_drawn(run, [stack.title for kind in _coordinates(run) for stack in kind[MOST_CURVES:]])


def _pages(summary: Summary, mechanism: Mechanism, run: Run | None) -> list[Figure]:
    pages = _Pages()
    head, *paragraphs = _paragraphs(summary)
    pages.text(head)
    axes = pages.axes(_DRAWING, 0, 1)
    try:
        figure(mechanism, ax=axes)
        axes.set_title("", loc="left")
    except KinfmuError:  # the problem that the verdicts state
        pages.remove(axes, _DRAWING)
    for paragraph in paragraphs:
        pages.text(paragraph)
    if run is not None:
        groups, note = _groups(run), wrap(plots_note(run), _COLUMNS)
        height = pages.height(-(-len(groups) // _ABREAST), (len(note) + 1) * _LINE)
        for number, panels in enumerate(groups):
            _panel(pages.axes(height, number % _ABREAST, _ABREAST), run, panels)
        pages.text([[Styled("faint", line)] for line in note])
    return pages.made


class _Pages:
    """Pages that are filled from the top."""

    def __init__(self) -> None:
        self.made: list[Figure] = []
        self._y = 0.0  # [pt], height of what is free on the last page

    def _space(self, height: float) -> None:
        """Begin a page if less than `height` is free on the last one."""
        from matplotlib.figure import Figure

        if not self.made or height > self._y - _EDGE:
            self.made.append(Figure(figsize=(_WIDTH / INCH, _HEIGHT / INCH), dpi=INCH, facecolor="white"))
            self._y = _HEIGHT - _EDGE

    def text(self, lines: Sequence[Sequence[Styled]]) -> None:
        """Write lines below what is there, on one page if they fit on one."""
        self._space(min(len(lines) * _LINE, _HEIGHT - 2.0 * _EDGE))
        look: dict[str, Any] = {"fontsize": _LETTERS, "family": "DejaVu Sans Mono", "va": "top", "parse_math": False}
        for line in lines:
            self._space(_LINE)
            x = _EDGE
            for style, text in line:
                colour = COLOURS.get(style, ink(GREY if style == "faint" else INK))
                weight = "bold" if style in (*COLOURS, "title") else "normal"
                if shown := text.strip():
                    at = (x + text.index(shown) * _LETTER) / _WIDTH, self._y / _HEIGHT
                    self.made[-1].text(*at, shown, color=colour, weight=weight, **look)
                x += len(text) * _LETTER
            self._y -= _LINE
        self._y -= 0.6 * _LINE

    def axes(self, height: float, column: int, columns: int) -> Axes:
        """Return axes for a picture in one of several columns, the first of which begins a row."""
        if column == 0:
            self._space(height)
            self._y -= height
        width = (_WIDTH - 2.0 * _EDGE) / columns
        left, right, bottom, top = 48.0, 10.0, 34.0, 24.0  # [pt] around the axes
        corner = (_EDGE + column * width + left) / _WIDTH, (self._y + bottom) / _HEIGHT
        size = (width - left - right) / _WIDTH, (height - bottom - top) / _HEIGHT
        return self.made[-1].add_axes((*corner, *size))

    def height(self, rows: int, below: float) -> float:
        """Return the height of a row of plots: lower ones, if they then fit on the last page with a text below them."""
        free = (self._y - _EDGE - below) / max(rows, 1)
        return free if _LEAST_PANEL <= free < _PANEL else _PANEL

    def remove(self, axes: Axes, height: float) -> None:
        """Take back the last row, of a height, which has only these axes."""
        axes.remove()
        self._y += height


def _paragraphs(summary: Summary) -> list[list[list[Styled]]]:
    """Return the lines of a report between empty lines."""
    return [list(lines) for is_text, lines in groupby(summary.lines(_COLUMNS), bool) if is_text]


def _groups(run: Run) -> list[list[Panel]]:
    """Return what to plot, columns of a unit together: positions, velocities, accelerations, efforts of drivers."""
    shown = [panel for kind in _coordinates(run) for stack in kind[:MOST_CURVES] for panel in stack.panels]
    drivers = {name.driver for name in run.input_names}
    efforts = [
        panel
        for stack in _moving_stacks(run)
        for panel in stack.panels
        if isinstance(panel.name, ForceName) and panel.name.owner in drivers and panel.name.noun in ("torque", "force")
    ]
    groups: dict[str, list[Panel]] = {}
    for panel in (*sorted(shown, key=lambda panel: panel.order), *efforts):
        groups.setdefault(panel.unit, []).append(panel)
    return list(groups.values())


def _coordinates(run: Run) -> list[list[Stack]]:
    """Return the coordinates of each unit that move otherwise than the only driver does, those that matter first."""
    kinds: dict[str, list[Stack]] = {}
    for stack in ranked(run, _moving_stacks(run)):
        if not _follows_driver(run, stack):
            kinds.setdefault(stack.panels[0].unit, []).append(stack)
    return list(kinds.values())


def _moving_stacks(run: Run) -> list[Stack]:
    return moving([run], stacks_of(run, ()), keeps_one=False)[0]


def _follows_driver(run: Run, stack: Stack) -> bool:
    """Return True for a coordinate that changes as the only driver does, forward or backward."""
    if len(run.input_names) != 3:
        return False
    values, driven = run[stack.title][run.good], run.inputs[run.good, 0]
    return any(np.ptp(values + sign * driven) <= _STILL * np.ptp(driven) for sign in (1.0, -1.0))


def _plot(run: Run, panels: Sequence[Panel]) -> Figure:
    from matplotlib.figure import Figure

    made = Figure(figsize=(WIDTH, HEIGHT), layout="constrained", facecolor="white")
    _panel(made.add_subplot(), run, panels)
    return made


def _panel(axes: Axes, run: Run, panels: Sequence[Panel]) -> None:
    """Draw columns of one unit over the driver, or over time where several drivers move."""
    x = run.input_names[0] if len(run.input_names) == 3 else None
    curves(axes, run, [panel.column for panel in panels], str(x or ""), degrees=True)
    dress(axes, "")
    shown, _ = degrees_of(panels[0].unit)
    across = axes.get_xlabel() if x is None else axes.get_xlabel().replace(symbol(x), x.driver)
    round_ticks(axes.xaxis, 6, "deg" if across.endswith("[deg]") else "")
    round_ticks(axes.yaxis, 6, shown)
    unit = numbers(axes, raised(shown))
    axes.set_ylabel(f"[{unit}]", fontsize=_LETTERS, color=ink(GREY))
    axes.set_xlabel(across, fontsize=_LETTERS, color=ink(GREY))
    names = [symbol(shortened(panel.column, _LONGEST)) for panel in panels]
    look: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.0, "frameon": False}
    axes.legend(labels=names, fontsize=7.0, ncols=2, handlelength=1.2, **look)
