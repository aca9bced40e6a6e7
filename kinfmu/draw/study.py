"""Pictures of studies: samples of designs, measures over one and two parameters, contributions of tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL, dress, span
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import FONT, GREY, INK, TITLE_EDGE, TITLE_LINE, ink, title_lines, titled_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_COLUMNS = 10  # of a matrix that can be read
MOST_DOTS = 4000  # of a panel
FAILED: palette.Colour = (200, 40, 40)  # designs that lack a measure
_BINS = 30
_EDGE = 0.05  # of the range of a column, between its ends and those of the axis
_CROSS: dict[str, Any] = {"s": 6.0, "linewidths": 0.6, "marker": "x"}
_LEVELS = 12
_ABREAST = 2
_SCALE_WIDTH = 10.0  # [pt], width of a scale of colours
WIDTH, HEIGHT = 210.0, 170.0  # [pt]
_MARKED = 40  # designs up to which each has a dot
MOST_BARS = 10  # of a measure
_BAR = 14.0  # [pt], of a bar with its gap


class Quantities(NamedTuple):
    """A column of a study: its name, its unit and its numbers (m,); datum: ' from 90 deg' where it is a deviation."""

    name: str
    unit: str
    values: FloatArray
    datum: str = ""

    @property
    def label(self) -> str:
        """'swing [rad]'; a pure number without its unit."""
        unit = "" if self.unit == "1" else f" [{self.unit.replace('2', chr(0xB2))}]"
        return f"{self.name}{self.datum}{unit}"


class PanelGrid(NamedTuple):
    """Panels on a sheet, all in points.

    rows, columns: Number of panels. width, height: Of a panel. between: Horizontal and vertical distance of panels.
    left, right, bottom: Margins.
    """

    rows: int
    columns: int
    width: float
    height: float
    between: tuple[float, float]
    left: float = 64.0
    right: float = 16.0
    bottom: float = 40.0


def sheet_of(layout: PanelGrid, title: str) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with a title and its panels, row by row."""
    across, down = layout.between
    width = layout.left + layout.columns * layout.width + (layout.columns - 1) * across + layout.right
    lines = title_lines(title, width - 2.0 * TITLE_EDGE)
    top = TITLE_EDGE + len(lines) * TITLE_LINE + 14.0
    height = top + layout.rows * layout.height + (layout.rows - 1) * down + layout.bottom
    figure = titled_figure(width, height, lines)
    panels = []
    for row in range(layout.rows):
        low = height - top - (row + 1) * layout.height - row * down
        left = [layout.left + column * (layout.width + across) for column in range(layout.columns)]
        size = (layout.width / width, layout.height / height)
        panels.append([figure.add_axes((x / width, low / height, *size)) for x in left])
    for axes in chain(*panels):
        dress(axes, "")
    return figure, panels


def name_axes(axes: Axes, x: str, y: str) -> None:
    """Write the names of both axes; '' for none."""
    look: dict[str, Any] = {"fontsize": SMALL, "color": ink(GREY), "labelpad": 3.0, "parse_math": False}
    axes.set_xlabel(x, **look)
    axes.set_ylabel(y, **look)


def titled(axes: Axes, text: str) -> None:
    """Write the title of a panel."""
    axes.set_title(text, fontsize=FONT, loc="left", color=ink(INK), parse_math=False)


def colour_of(index: int) -> palette.Colour:
    """Return the colour of a measure by its place."""
    order = (5, 4, 2, 3, 0, 1)
    return palette.on_white(palette.BODIES[order[index % len(order)]])


def few_ticks(axes: Axes, x: int | None, y: int | None) -> None:
    """Limit the number of intervals between ticks."""
    if x is not None:
        axes.locator_params(axis="x", nbins=x)
    if y is not None:
        axes.locator_params(axis="y", nbins=y)


def scatter_matrix(parameters: Sequence[Quantities], measures: Sequence[Quantities], title: str) -> Figure:
    """Return a scatter matrix: a row and a column for each parameter and each measure, histograms on the diagonal.

    Panels of a row and of a column have one axis. Designs that lack a measure are marked where their numbers are known.

    parameters: The parameters of the designs. measures: Their measures, NaN for designs without a value.
    """
    columns = [*parameters, *measures]
    count = len(columns)
    size = 86.0 if count > 4 else 110.0
    failed = ~np.all([np.isfinite(one.values) for one in measures], axis=0)
    figure, panels = sheet_of(PanelGrid(count, count, size, size, (10.0, 10.0), left=70.0, bottom=64.0), title)
    limits = [_limits(one.values) for one in columns]
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
                _dots(axes, horizontal.values, vertical.values, failed, colour)
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
        _name_failed(figure, int(failed.sum()), len(failed))
    return figure


def scatter_into(axes: Axes, parameter: Quantities, measure: Quantities) -> None:
    """Draw a measure over a parameter, a dot for each design that has a value."""
    failed = ~np.isfinite(measure.values)
    _dots(axes, parameter.values, measure.values, failed, ink(colour_of(0)))
    axes.set_xlim(_limits(parameter.values))
    axes.set_ylim(_limits(measure.values))
    name_axes(axes, parameter.label, measure.label)


def _limits(values: FloatArray) -> tuple[float, float]:
    """Return the ends of the axis of a column."""
    numbers = values[np.isfinite(values)]
    if not len(numbers):
        return 0.0, 1.0
    low, high = float(numbers.min()), float(numbers.max())
    edge = _EDGE * (high - low) or max(_EDGE * abs(high), 1e-9)
    return low - edge, high + edge


def _histogram(axes: Axes, values: FloatArray, failed: NDArray[np.bool_], colour: Any) -> None:
    """Draw how many designs have which value, with an axis of its own; failed ones on top."""
    overlaid = axes.twinx()
    overlaid.set_axis_off()
    known = np.isfinite(values)
    parts = [(values[known & ~failed], colour), (values[known & failed], ink(FAILED))]
    parts = [part for part in parts if len(part[0])]
    if parts:
        look: dict[str, Any] = {"edgecolor": "white", "linewidth": 0.3, "stacked": True, "bins": _BINS}
        overlaid.hist([part[0] for part in parts], color=[part[1] for part in parts], **look)


def _dots(axes: Axes, x: FloatArray, y: FloatArray, failed: NDArray[np.bool_], colour: Any) -> None:
    """Draw a dot for each design, a cross for each that failed, where both numbers are known."""
    known = np.isfinite(x) & np.isfinite(y)
    rasterized, step = len(x) > _BINS**2, -(-len(x) // MOST_DOTS)
    bad, good = known & failed, known & ~failed
    if bad.any():
        axes.scatter(x[bad][::step], y[bad][::step], color=ink(FAILED), rasterized=rasterized, **_CROSS)
    axes.scatter(x[good][::step], y[good][::step], color=colour, rasterized=rasterized, s=3.0, linewidths=0.0)


def _name_failed(figure: Figure, failed: int, count: int) -> None:
    """Write below the panels what a cross is."""
    from matplotlib.lines import Line2D

    cross = Line2D([], [], color=ink(FAILED), marker="x", linestyle="none", markersize=4.0, markeredgewidth=0.8)
    text = f"a measure has no value: {failed} of {count} designs"
    figure.legend([cross], [text], loc="lower left", fontsize=SMALL, frameon=False, labelcolor=ink(GREY))


def contours(x: Quantities, y: Quantities, measures: Sequence[Quantities], title: str) -> Figure:
    """Return a figure of measures over a grid of two parameters; designs without a value stay white.

    x: The first parameter, its values (p,) on the grid. y: The second parameter, its values (q,) on the grid. measures:
    The measures, (p, q) each.
    """
    columns = min(_ABREAST, len(measures))
    layout = PanelGrid(-(-len(measures) // columns), columns, WIDTH, HEIGHT, (118.0, 56.0), left=52.0, right=66.0)
    figure, panels = sheet_of(layout, title)
    every = list(chain(*panels))
    for axes in every[len(measures) :]:
        axes.remove()
    for measure, axes in zip(measures, every, strict=False):
        box = axes.get_position()
        filled = _fill(axes, x, y, measure)
        if filled is not None:
            place = (box.x1 + 8.0 / WIDTH * box.width, box.y0, _SCALE_WIDTH / WIDTH * box.width, box.height)
            _scale(figure, filled, cax=figure.add_axes(place))
    return figure


def contours_into(axes: Axes, x: Quantities, y: Quantities, measure: Quantities) -> None:
    """Draw a measure (p, q) over a grid of two parameters, with the scale of its colours next to the Axes."""
    filled = _fill(axes, x, y, measure)
    if filled is not None:
        _scale(axes.figure, filled, ax=axes)


def _fill(axes: Axes, x: Quantities, y: Quantities, measure: Quantities) -> Any:
    """Draw the contours of a measure and return them; None if there are none."""
    axes.grid(visible=False)
    table, filled = np.ma.masked_invalid(measure.values.T), None
    numbers = table.compressed()
    if len(numbers) and np.ptp(numbers) > 1e-12 * np.abs(numbers).max():
        filled = axes.contourf(x.values, y.values, table, levels=_LEVELS, cmap="viridis")
    else:
        text = f"{numbers[0]:.6g} everywhere" if len(numbers) else "no values"
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


def response(over: Quantities, measures: Sequence[Quantities], title: str) -> Figure:
    """Return a figure of measures over a parameter; designs without a value are gaps.

    over: The parameter. measures: The measures of the same designs.
    """
    figure, panels = sheet_of(PanelGrid(len(measures), 1, 360.0, 110.0, (0.0, 22.0)), title)
    for k, (measure, (axes,)) in enumerate(zip(measures, panels, strict=True)):
        response_into(axes, over, measure, k)
        is_last = k == len(measures) - 1
        name_axes(axes, over.label if is_last else "", measure.label)
        few_ticks(axes, None, 4)
        axes.yaxis.set_label_coords(-44.0 / 360.0, 0.5)
        axes.tick_params(labelbottom=is_last)
    return figure


def response_into(axes: Axes, over: Quantities, measure: Quantities, place: int = 0) -> None:
    """Draw a measure over a parameter; place: of the measure among others, which decides its colour."""
    order = np.argsort(over.values, kind="stable")
    marker = "o" if len(order) <= _MARKED else ""
    look: dict[str, Any] = {"color": ink(colour_of(place)), "linewidth": 1.4, "marker": marker, "markersize": 3.0}
    axes.plot(over.values[order], measure.values[order], **look)
    axes.set_xlim(*span(over.values, 0.02))
    name_axes(axes, over.label, measure.label)


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
    """Return a figure with a panel of bars for each measure."""
    most = max([min(len(one.parts), MOST_BARS) for one in measures] + [1])
    layout = PanelGrid(len(measures), 1, 330.0, most * _BAR + 4.0, (0.0, 40.0), left=100.0, right=48.0)
    figure, panels = sheet_of(layout, title)
    for k, (measure, (axes,)) in enumerate(zip(measures, panels, strict=True)):
        contributions_into(axes, measure, k, most)
        if k < len(measures) - 1:
            axes.tick_params(labelbottom=False)
            name_axes(axes, "", "")
    return figure


def contributions_into(axes: Axes, measure: Contributed, place: int = 0, most: int = 0) -> None:
    """Draw the bars of a measure.

    place: Its place among others, which decides the colour. most: Number of bars that the Axes hold. Default: those of
    the measure.
    """
    shown = list(measure.parts.items())[:MOST_BARS]
    places = range(len(shown))
    axes.barh(places, [100.0 * part for _, part in shown], height=0.7, color=ink(colour_of(place)))
    for k, (_, part) in zip(places, shown, strict=True):
        look: dict[str, Any] = {"va": "center", "fontsize": SMALL, "color": ink(INK), "textcoords": "offset points"}
        axes.annotate(f"{100.0 * part:.1f} %", (100.0 * part, k), xytext=(4.0, 0.0), **look)
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
