"""What each parameter contributes to the variance of a measure: bars, the largest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from kinfmu.draw.chart import SMALL
from kinfmu.draw.sheet import GREY, INK, ink
from kinfmu.draw.study_panels import PanelGrid, colour_of, name_axes, sheet_of, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_BARS = 10  # of a measure
_BAR = 14.0  # [pt], of a bar with its gap


class Contributed(NamedTuple):
    """A measure with what tolerances contribute to it.

    name, unit: Of the measure. first_order, sampled: Its standard deviations. parts: By parameter its part of the
    variance, 0 to 1, the largest first; none: unknown.
    """

    name: str
    unit: str
    first_order: float
    sampled: float
    parts: Mapping[str, float]


def contributions(measures: Sequence[Contributed], title: str) -> Figure:
    """Return a figure with a panel of bars for each measure.

    Args:
        measures: The measures.
        title: Title of the figure.

    """
    most = max([min(len(one.parts), MOST_BARS) for one in measures] + [1])
    layout = PanelGrid(len(measures), 1, 330.0, most * _BAR + 4.0, (0.0, 40.0), left=100.0, right=48.0)
    made, panels = sheet_of(layout, title)
    for k, (measure, (axes,)) in enumerate(zip(measures, panels, strict=True)):
        contributions_into(axes, measure, k, most)
        if k < len(measures) - 1:
            axes.tick_params(labelbottom=False)
            name_axes(axes, "", "")
    return made


def contributions_into(axes: Axes, measure: Contributed, place: int = 0, most: int = 0) -> None:
    """Draw the bars of a measure.

    Args:
        axes: The Axes.
        measure: The measure.
        place: Its place among others, which decides the colour.
        most: Number of bars that the Axes hold. Default: those of the measure.

    """
    shown = list(measure.parts.items())[:MOST_BARS]
    places = range(len(shown))
    axes.barh(places, [100.0 * part for _, part in shown], height=0.7, color=ink(colour_of(place)))
    for k, (_, part) in zip(places, shown, strict=True):
        axes.annotate(
            f"{100.0 * part:.1f} %",
            (100.0 * part, k),
            xytext=(4.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=SMALL,
            color=ink(INK),
        )
    if not shown:
        axes.text(0.5, 0.5, "unknown", fontsize=SMALL, ha="center", transform=axes.transAxes, color=ink(GREY))
    axes.set_yticks(list(places), [name for name, _ in shown])
    axes.tick_params(axis="y", length=0.0)
    axes.set_ylim((most or max(1, len(shown))) - 0.5, -0.6)
    axes.set_xlim(0.0, 100.0)
    axes.grid(visible=False, axis="y")
    name_axes(axes, "part of the variance [%]", "")
    unit = "" if measure.unit == "1" else f" {measure.unit}"
    both = f"{measure.first_order:.4g}{unit} to first order, {measure.sampled:.4g}{unit} sampled"
    titled(axes, f"{measure.name}: deviation {both}")
