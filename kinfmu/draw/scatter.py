"""Samples of designs: every measure over every parameter, and the distribution of every column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import GREY, ink
from kinfmu.draw.study_panels import PanelGrid, Quantities, colour_of, few_ticks, name_axes, sheet_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COLUMNS = 10  # of a matrix that can be read
MOST_DOTS = 4000  # of a panel
FAILED: palette.Colour = (200, 40, 40)  # designs that lack a measure
_BINS = 30
_EDGE = 0.05  # of the range of a column, between its ends and those of the axis
_CROSS: dict[str, Any] = {"s": 6.0, "linewidths": 0.6, "marker": "x"}


def scatter_matrix(parameters: Sequence[Quantities], measures: Sequence[Quantities], title: str) -> Figure:
    """Return a scatter matrix: a row and a column for each parameter and each measure, histograms on the diagonal.

    Panels of a row and of a column have one axis. Designs that lack a measure are marked where their numbers are known.

    Args:
        parameters: The parameters of the designs.
        measures: Their measures, NaN for designs without a value.
        title: Title of the figure.

    """
    columns = [*parameters, *measures]
    count = len(columns)
    size = 86.0 if count > 4 else 110.0
    failed = ~np.all([np.isfinite(one.values) for one in measures], axis=0)
    made, panels = sheet_of(PanelGrid(count, count, size, size, (10.0, 10.0), left=70.0, bottom=64.0), title)
    limits = [_limits(one.values) for one in columns]
    step = -(-len(failed) // MOST_DOTS)
    for row, (vertical, line) in enumerate(zip(columns, panels, strict=True)):
        is_measure = row >= len(parameters)
        colour = ink(colour_of(row - len(parameters)) if is_measure else palette.on_white(palette.GROUND))
        for column, (horizontal, axes) in enumerate(zip(columns, line, strict=True)):
            axes.grid(visible=False)
            axes.set_xlim(limits[column])
            axes.set_ylim(limits[row])
            if row == column:
                _histogram(axes, vertical.values, failed, colour)
            else:
                _dots(axes, horizontal.values, vertical.values, failed, colour, step)
            few_ticks(axes, 3, 3)
            is_last, is_first = row == count - 1, column == 0
            name_axes(axes, horizontal.label if is_last else "", vertical.label if is_first else "")
            axes.tick_params(labelbottom=is_last, labelleft=is_first, labelsize=SMALL - 1.0)
            axes.ticklabel_format(axis="both", useOffset=False)
            if is_first:
                axes.yaxis.set_label_coords(-46.0 / size, 0.5)
            if is_last:
                axes.xaxis.set_label_coords(0.5, -24.0 / size)
    if failed.any():
        _name_failed(made, int(failed.sum()), len(failed))
    return made


def scatter_into(axes: Axes, parameter: Quantities, measure: Quantities) -> None:
    """Draw a measure over a parameter, a dot for each design that has a value."""
    failed = ~np.isfinite(measure.values)
    _dots(axes, parameter.values, measure.values, failed, ink(colour_of(0)), -(-len(failed) // MOST_DOTS))
    axes.set_xlim(_limits(parameter.values))
    axes.set_ylim(_limits(measure.values))
    name_axes(axes, parameter.label, measure.label)


def _limits(values: FloatArray) -> tuple[float, float]:
    """Return the ends of the axis of a column."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    edge = _EDGE * (high - low) or max(_EDGE * abs(high), 1e-9)
    return low - edge, high + edge


def _histogram(axes: Axes, values: FloatArray, failed: NDArray[np.bool_], colour: Any) -> None:
    """Draw how many designs have which value, with an axis of its own; failed ones on top."""
    own = axes.twinx()
    own.set_axis_off()
    known = np.isfinite(values)
    parts = [(values[known & ~failed], colour), (values[known & failed], ink(FAILED))]
    parts = [part for part in parts if len(part[0])]
    if parts:
        look: dict[str, Any] = {"edgecolor": "white", "linewidth": 0.3, "stacked": True, "bins": _BINS}
        own.hist([part[0] for part in parts], color=[part[1] for part in parts], **look)


def _dots(axes: Axes, x: FloatArray, y: FloatArray, failed: NDArray[np.bool_], colour: Any, step: int) -> None:
    """Draw a dot for each design, a cross for each that failed, where both numbers are known."""
    known = np.isfinite(x) & np.isfinite(y)
    rasterized = len(x) > _BINS**2
    bad, good = known & failed, known & ~failed
    if bad.any():
        axes.scatter(x[bad][::step], y[bad][::step], color=ink(FAILED), rasterized=rasterized, **_CROSS)
    axes.scatter(x[good][::step], y[good][::step], color=colour, rasterized=rasterized, s=3.0, linewidths=0.0)


def _name_failed(made: Figure, failed: int, count: int) -> None:
    """Write below the panels what a cross is."""
    from matplotlib.lines import Line2D

    cross = Line2D([], [], color=ink(FAILED), marker="x", linestyle="none", markersize=4.0, markeredgewidth=0.8)
    text = f"a measure has no value: {failed} of {count} designs"
    made.legend([cross], [text], loc="lower left", fontsize=SMALL, frameon=False, labelcolor=ink(GREY))
