"""Measures over two parameters: filled contours, a panel for each measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL
from kinfmu.draw.sheet import GREY, ink
from kinfmu.draw.study_panels import PanelGrid, Quantities, few_ticks, name_axes, sheet_of, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEVELS = 12
_ABREAST = 2
_BAR = 10.0  # [pt], width of a scale of colours
_WIDTH, _HEIGHT = 210.0, 170.0  # [pt]


def contours(x: Quantities, y: Quantities, measures: Sequence[Quantities], title: str) -> Figure:
    """Return a figure of measures over a grid of two parameters; designs without a value stay white.

    Args:
        x: The first parameter, its values (p,) on the grid.
        y: The second parameter, its values (q,) on the grid.
        measures: The measures, (p, q) each.
        title: Title of the figure.

    """
    columns = min(_ABREAST, len(measures))
    layout = PanelGrid(-(-len(measures) // columns), columns, _WIDTH, _HEIGHT, (118.0, 56.0), left=52.0, right=66.0)
    made, panels = sheet_of(layout, title)
    every = [axes for row in panels for axes in row]
    for axes in every[len(measures) :]:
        axes.remove()
    for measure, axes in zip(measures, every, strict=False):
        box = axes.get_position()
        filled = _fill(axes, x, y, measure)
        if filled is not None:
            place = (box.x1 + 8.0 / _WIDTH * box.width, box.y0, _BAR / _WIDTH * box.width, box.height)
            _scale(made, filled, cax=made.add_axes(place))
    return made


def contours_into(axes: Axes, x: Quantities, y: Quantities, measure: Quantities) -> None:
    """Draw a measure (p, q) over a grid of two parameters, with the scale of its colours next to the Axes."""
    filled = _fill(axes, x, y, measure)
    if filled is not None:
        _scale(axes.figure, filled, ax=axes)


def _fill(axes: Axes, x: Quantities, y: Quantities, measure: Quantities) -> Any:
    """Draw the contours of a measure and return them; None if there are none."""
    axes.grid(visible=False)
    known, filled = np.ma.masked_invalid(measure.values.T), None
    if known.count() and np.ptp(known.compressed()) > 1e-12 * np.abs(known.compressed()).max():
        filled = axes.contourf(x.values, y.values, known, levels=_LEVELS, cmap="viridis")
    else:
        text = f"{known.compressed()[0]:.6g} everywhere" if known.count() else "no values"
        axes.text(0.5, 0.5, text, fontsize=SMALL, ha="center", transform=axes.transAxes, color=ink(GREY))
    axes.set_xlim(*_ends(x.values))
    axes.set_ylim(*_ends(y.values))
    few_ticks(axes, 5, 5)
    name_axes(axes, x.label, y.label)
    titled(axes, measure.label)
    return filled


def _scale(figure: Any, filled: Any, **place: Any) -> None:
    """Draw the scale of colours; place: `cax` or `ax` of a colorbar."""
    bar = figure.colorbar(filled, **place)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=SMALL, length=2.0, width=0.5, color=ink(GREY), labelcolor=ink(GREY))


def _ends(values: FloatArray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return (low, high) if low < high else (low - 0.5, high + 0.5)
