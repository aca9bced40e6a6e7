"""Samples of designs: every measure over every parameter, and the distribution of every column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.draw.chart import SMALL
from kinfmu.draw.sheet import ink
from kinfmu.draw.study_panels import PanelGrid, Quantities, colour_of, few_ticks, name_axes, sheet_of
from kinfmu.scene import palette

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_COLUMNS = 10  # of a matrix that can be read
MOST_DOTS = 4000  # of a panel
_BINS = 30


def scatter_matrix(parameters: Sequence[Quantities], measures: Sequence[Quantities], title: str) -> Figure:
    """Return a scatter matrix: a row and a column for each parameter and each measure, histograms on the diagonal.

    Args:
        parameters: The parameters of the designs.
        measures: Their measures; designs without a value are left out.
        title: Title of the figure.

    """
    columns = [*parameters, *measures]
    count = len(columns)
    size = 86.0 if count > 4 else 110.0
    made, panels = sheet_of(PanelGrid(count, count, size, size, (10.0, 10.0), left=70.0, bottom=48.0), title)
    step = -(-len(columns[0].values) // MOST_DOTS)
    for row, (vertical, line) in enumerate(zip(columns, panels, strict=True)):
        is_measure = row >= len(parameters)
        colour = ink(colour_of(row - len(parameters)) if is_measure else palette.on_white(palette.GROUND))
        for column, (horizontal, axes) in enumerate(zip(columns, line, strict=True)):
            axes.grid(visible=False)
            x, y = horizontal.values, vertical.values
            if row == column:
                axes.hist(y[np.isfinite(y)], bins=_BINS, color=colour, edgecolor="white", linewidth=0.3)
                axes.set_yticks([])
            else:
                known = np.isfinite(x) & np.isfinite(y)
                dots: dict[str, Any] = {"s": 3.0, "linewidths": 0.0}
                axes.scatter(x[known][::step], y[known][::step], color=colour, rasterized=len(x) > _BINS**2, **dots)
            few_ticks(axes, 3, 3 if row != column else None)
            is_last, is_first = row == count - 1, column == 0
            name_axes(axes, horizontal.label if is_last else "", vertical.label if is_first else "")
            axes.tick_params(labelbottom=is_last, labelleft=is_first and row != column, labelsize=SMALL - 1.0)
            axes.ticklabel_format(axis="both" if row != column else "x", useOffset=False)
            if is_first:
                axes.yaxis.set_label_coords(-46.0 / size, 0.5)
            if is_last:
                axes.xaxis.set_label_coords(0.5, -24.0 / size)
    return made
