"""Measures over one parameter: a panel for each, one below the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.sheet import ink
from kinfmu.draw.study_panels import PanelGrid, Quantities, colour_of, few_ticks, name_axes, sheet_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKED = 40  # designs up to which each has a dot


def response(over: Quantities, measures: Sequence[Quantities], title: str) -> Figure:
    """Return a figure of measures over a parameter; designs without a value are gaps.

    Args:
        over: The parameter.
        measures: The measures of the same designs.
        title: Title of the figure.

    """
    made, panels = sheet_of(PanelGrid(len(measures), 1, 360.0, 110.0, (0.0, 22.0)), title)
    for k, (measure, (axes,)) in enumerate(zip(measures, panels, strict=True)):
        response_into(axes, over, measure, k)
        is_last = k == len(measures) - 1
        name_axes(axes, over.label if is_last else "", measure.label)
        few_ticks(axes, None, 4)
        axes.yaxis.set_label_coords(-44.0 / 360.0, 0.5)
        axes.tick_params(labelbottom=is_last)
    return made


def response_into(axes: Axes, over: Quantities, measure: Quantities, place: int = 0) -> None:
    """Draw a measure over a parameter; place: of the measure among others, which decides its colour."""
    order = np.argsort(over.values, kind="stable")
    marker = "o" if len(order) <= _MARKED else ""
    look: dict[str, Any] = {"color": ink(colour_of(place)), "linewidth": 1.4, "marker": marker, "markersize": 3.0}
    axes.plot(over.values[order], measure.values[order], **look)
    axes.set_xlim(*_limits(over.values))
    name_axes(axes, over.label, measure.label)


def _limits(values: FloatArray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    edge = 0.02 * (high - low) or 0.5
    return low - edge, high + edge
