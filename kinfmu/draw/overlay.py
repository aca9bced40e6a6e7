"""Overlays: columns of one or two runs over any other column, one panel for each unit; polar plots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import (
    LIGHT,
    LOST,
    SMALL,
    Abscissa,
    abscissa,
    dress,
    equal_below,
    gaps,
    label_size,
    labelled,
    numbers,
    powers_of_ten,
    round_ticks,
    rows_of,
    symbol,
    unit_in,
)
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import GREY, TITLE_EDGE, TITLE_LINE, ink, title_lines, titled_figure
from kinfmu.errors import FigureError
from kinfmu.run import Run
from kinfmu.run.axis import ROUND_OFF, axis_of, shown_range
from kinfmu.run.channels import chosen_columns
from kinfmu.units import degrees_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_PANELS = 8  # more make a sheet too large to print
MOST_CURVES = 18  # of a panel: so many colours differ
_WIDTH, _HEIGHT, _SQUARE = 420.0, 130.0, 330.0  # [pt] of a panel; longest side of an equal or polar one
_LONGEST = 28  # letters of a name with its unit that fit next to a panel in one line
_TICK = 36.0  # [pt] for a number along the horizontal axis of an equal panel
_LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 60.0, 24.0, 34.0, 34.0, 16.0  # [pt] around and between panels
_LEGEND_LINE, _LEGEND_COLUMNS = 12.0, 3  # [pt]; names in a line of a legend
_WIDE, _NARROW = 3.6, 1.2  # [pt], curves of the first of two runs and of the second one or of a single one
_WIDER = 2.4  # [pt] of a curve for each equal one above it
LOGARITHMIC = ("solver.residual", "solver.margin", "solver.error_", "watch.")  # columns on a scale of powers of ten
LEAST = 1e-18  # smallest value on such a scale: zeros have no logarithm
_ROOM = 0.25  # of the range of the values, between the centre and the least value if that is negative
_INNERMOST = 0.15  # of the radius; numbers nearer to the centre would be on one another
_PLACES = np.radians(np.arange(11.25, 360.0, 22.5))  # of the numbers, between the lines of the grid


@dataclass(frozen=True, eq=False)
class Overlay:
    """What an overlay shows.

    runs: one or two; names: of the two runs; columns: of the panels; xs: columns of the horizontal axis, one or one for
    each column, none for the axis of the run; degrees: angles of columns in degrees; polar: the horizontal axis is the
    polar angle.
    """

    runs: tuple[Run, ...]
    names: tuple[str, str]
    columns: tuple[str, ...]
    xs: tuple[str, ...]
    degrees: bool
    polar: bool

    def x(self, run: Run, column: str) -> Abscissa:
        """Return the horizontal axis of a column's curve."""
        if len(self.xs) <= 1:
            return abscissa(run, *self.xs)
        return abscissa(run, self.xs[self.columns.index(column)])

    def unit(self, column: str) -> tuple[str, float]:
        """Return the unit in which a column is shown, and its factor."""
        unit = unit_in(self.runs[0], column)
        return degrees_of(unit) if self.degrees else (unit, 1.0)

    def panels(self) -> list[list[str]]:
        """Return the columns of each panel: those of one unit and one kind of scale."""
        found: dict[tuple[str, bool], list[str]] = {}
        for column in self.columns:
            found.setdefault((self.unit(column)[0], is_logarithmic(column)), []).append(column)
        return list(found.values())


def is_logarithmic(column: str) -> bool:
    """Return True for diagnostics that are shown on a scale of powers of ten."""
    return column.startswith(LOGARITHMIC)


def overlay(
    runs: Sequence[Run], names: tuple[str, str], columns: Sequence[str], xs: Sequence[str], **how: bool
) -> Overlay:
    """Return what an overlay shows after checking it; arguments and errors as in `plot`."""
    first = runs[0]
    chosen = chosen_columns(first, columns) if columns else tuple(first.names or first.outputs)
    if len(xs) > 1 and len(xs) != len(chosen):
        raise FigureError(
            f"x names {len(xs)} columns for {len(chosen)} curves; name one for all curves, or one for each of them"
        )
    if how.get("polar") and not xs:
        xs = _driver_angle(first)
    shown = Overlay(tuple(runs), names, chosen, tuple(xs), **how)
    for run in runs:
        if not len(run) or not chosen:
            raise FigureError(f"the run has no {'samples' if chosen else 'columns'} to plot")
        for column in (*chosen, *xs):
            run[column]  # reports what the run does not hold
    if shown.polar:
        for column in chosen:
            _check_angle(first, shown.x(first, column))
    labels = {(shown.x(run, column).unit, shown.x(run, column).is_axis) for run in runs for column in chosen}
    if len(labels) > 1:
        units = " and ".join(sorted(unit or "numbers" for unit, _ in labels))
        raise FigureError(f"one horizontal axis cannot show {units}; name columns x of one unit that both runs hold")
    panels = shown.panels()
    most = max(map(len, panels))
    if len(panels) > MOST_PANELS:
        raise FigureError(
            f"{len(chosen)} columns make {len(panels)} panels, one for each unit; a sheet holds {MOST_PANELS}: "
            f"choose some of them by name, such as {chosen[0]}"
        )
    if most > MOST_CURVES:
        fullest = max(panels, key=len)
        raise FigureError(
            f"the panel [{shown.unit(fullest[0])[0]}] would have {most} curves and holds {MOST_CURVES}: leave out at "
            f"least {most - MOST_CURVES} of them, by a minus in front of its name as in -{fullest[-1]}"
        )
    return shown


def _driver_angle(run: Run) -> Sequence[str]:
    """Return the column of the only driver of an angle, for a polar plot of a run over another axis; else none."""
    angles = [name for name in run.input_names[::3] if name.quantity.kind == "angle" and name not in run.absent]
    return angles if len(angles) == 1 and run.axis not in run.input_names else ()


def _check_angle(run: Run, across: Abscissa) -> None:
    """Raise a FigureError that names an angle of the run if the horizontal axis of a polar plot is no angle."""
    if across.unit in ("deg", "rad"):
        return
    angle = next((name for name in run.outputs if name.is_angle and name not in run.absent), "")
    cure = f"; name one by x (--x), such as {angle}" if angle else ", and the run has none"
    raise FigureError(f"a polar plot needs an angle, not {across.label}{cure}")


def overlay_sheet(shown: Overlay) -> Figure:
    """Return the figure of an overlay: the panels of all units below each other, with a legend above each."""
    panels = shown.panels()
    equal = [_is_map(shown, panel) for panel in panels]
    sizes = [_size(shown, panel, is_map=is_map) for panel, is_map in zip(panels, equal, strict=True)]
    legends = [_legend_height(shown, panel) for panel in panels]
    title = sheet_title(shown.runs, shown.names)
    width = _LEFT + max(size[0] for size in sizes) + _RIGHT
    lines = title_lines(title, width - 2.0 * TITLE_EDGE)
    above = _TOP + max(len(lines) - 1, 0) * TITLE_LINE
    polar_margin = 22.0 if shown.polar else 0.0  # [pt]; angles are written around
    heights = [size[1] + legend + _GAP + 2.0 * polar_margin for size, legend in zip(sizes, legends, strict=True)]
    labels_below = any(equal)
    height = above + sum(heights) - _GAP + _BOTTOM + (_BOTTOM * (len(panels) - 1) if labels_below else 0.0)
    made = titled_figure(width, height, lines)
    top = height - above
    for number, panel in enumerate(panels):
        (wide, high), legend = sizes[number], legends[number]
        box = (_LEFT / width, (top - legend - polar_margin - high) / height, wide / width, high / height)
        axes = made.add_axes(box, projection="polar" if shown.polar else None)
        _panel(axes, shown, panel)
        is_last = number == len(panels) - 1
        if equal[number]:
            axes.set_aspect("equal", adjustable="datalim")
            axes.locator_params(axis="x", nbins=max(int(wide / _TICK), 2))
        if not shown.polar:
            axes.yaxis.set_label_coords(-44.0 / wide, 0.5)
            if is_last or labels_below:
                axes.set_xlabel(_x_label(shown), fontsize=SMALL, color=ink(GREY), labelpad=1.0)
            else:
                axes.tick_params(labelbottom=False)
        top -= heights[number] + (_BOTTOM if labels_below else 0.0)
    return made


def check_comparable(runs: Sequence[Run]) -> None:
    """Raise a FigureError for two runs whose units of length or axes differ."""
    a, b = runs[0], runs[-1]
    if a.length_unit != b.length_unit:
        raise FigureError(f"the runs measure lengths in {a.length_unit} and {b.length_unit}; they need the same unit")
    labels = [axis_of(run).label for run in (a, b)]
    per = [axis_of(run).per for run in (a, b)]
    if labels[0] != labels[1] or per[0] != per[1]:
        raise FigureError(
            f"the runs are over {labels[0]} and {labels[1]}, with rates per {per[0]} and per {per[1]}; two runs in one "
            "plot need the same axis and rates"
        )


def sheet_title(runs: Sequence[Run], names: tuple[str, str]) -> str:
    """Return the title of a run, with the names of two runs."""
    info = runs[0].info
    title = info.get("title") or info.get("name") or ""
    if len(runs) == 1:
        return title
    a, b = names
    return f"{title}{': ' if title else ''}{a} (wide), {b} (narrow)"


def _x_label(shown: Overlay) -> str:
    first = shown.x(shown.runs[0], shown.columns[0])
    if len(shown.xs) <= 1:
        return first.label
    axes = {name.rpartition(".")[2] for name in shown.xs}
    return labelled(axes.pop() if len(axes) == 1 else "", first.unit).strip()


def _is_map(shown: Overlay, panel: Sequence[str]) -> bool:
    """Return True if both axes are positions, velocities, accelerations or forces: then both have the same scale."""
    if shown.polar or not shown.xs:
        return False
    run, columns = shown.runs[0], {*panel, *shown.xs}
    coordinates = [name for name in (*run.outputs, *run.fixed) if not name.is_angle]
    kinds = [{name.derivative(order) for name in coordinates} for order in range(3)]
    return any(columns <= kind for kind in kinds) or {unit_in(run, column) for column in columns} == {"N"}


def _size(shown: Overlay, panel: Sequence[str], *, is_map: bool) -> tuple[float, float]:
    """Return width and height of a panel [pt]; one with equal scales is as long and as high as its paths need."""
    if shown.polar:
        return _SQUARE, _SQUARE
    if not is_map:
        return _WIDTH, _HEIGHT
    along = np.concatenate([shown.x(run, column).values for run in shown.runs for column in panel])
    up = np.concatenate([values_of(run, column) for run in shown.runs for column in panel])
    wide, high = (
        float(np.ptp(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0 for values in (along, up)
    )
    longest = max(wide, high)
    if longest == 0.0:
        return _SQUARE, _SQUARE
    least = _HEIGHT / _SQUARE
    return _SQUARE * max(wide / longest, least), _SQUARE * max(high / longest, least)


def _legend_height(shown: Overlay, panel: Sequence[str]) -> float:
    rows = -(-len(panel) // _LEGEND_COLUMNS) if len(panel) > 1 or shown.polar else 0
    return rows * _LEGEND_LINE + (6.0 if rows else 0.0)


def _panel(axes: Any, shown: Overlay, panel: Sequence[str]) -> None:
    """Draw the curves of one unit."""
    unit, factor = shown.unit(panel[0])
    is_log = is_logarithmic(panel[0])
    everything = []
    equal = equal_below([shown.runs[0][column] for column in panel]) if len(shown.xs) <= 1 else [0] * len(panel)
    for number, run in enumerate(shown.runs):
        is_wide = len(shown.runs) == 2 and number == 0
        for index, column in enumerate(panel):
            x = shown.x(run, column)
            along = x.angles if shown.polar else x.values
            values = values_of(run, column) * factor
            if is_log:
                values = np.maximum(np.abs(values), LEAST)
            colour = curve_colour(index)
            rows = np.union1d(rows_of(values), rows_of(along))
            look: dict[str, Any] = {"color": ink(palette.lighter(colour) if is_wide else colour)}
            if np.isfinite(values).sum() < 2:
                look |= {"marker": "o", "markersize": 3.0}
            label = symbol(column) if number == len(shown.runs) - 1 else "_"
            width = _WIDE if is_wide else _NARROW + _WIDER * equal[index]
            axes.plot(along[rows], values[rows], linewidth=width, label=label, **look)
            everything.append((along, values))
    if shown.polar:
        _legend(axes, shown, panel, radial_scale(axes, everything))
        return
    _scales(axes, shown, panel, np.concatenate([values for _, values in everything]), unit)
    if len(panel) > 1:
        _legend(axes, shown, panel)


def _scales(axes: Any, shown: Overlay, panel: Sequence[str], values: FloatArray, unit: str) -> None:
    """Give a panel its scales, names and grid."""
    x = shown.x(shown.runs[0], panel[0])
    grey = ink(GREY)
    dress(axes, "")
    if is_logarithmic(panel[0]):
        powers_of_ten(axes, values)
    elif not _is_map(shown, panel):
        shown_values = range_of(values)
        if shown_values:
            axes.set_ylim(*shown_values)
        round_ticks(axes.yaxis, 5, unit)
        unit = numbers(axes, unit)
    else:
        round_ticks(axes.yaxis, 9, unit)
    if x.is_angle:
        axes.margins(x=0.01)
    round_ticks(axes.xaxis, 9, x.unit)
    name = symbol(panel[0]) if len(panel) == 1 else ""
    label = labelled(name, unit).strip()
    axes.set_ylabel(label, fontsize=label_size(label, _LONGEST, SMALL), color=grey, labelpad=3.0, parse_math=False)
    if x.is_axis and not any(name.startswith("solver.status") for name in panel):
        for run in shown.runs:
            for first, last in gaps(run, shown.x(run, panel[0]).values):
                axes.axvspan(first, last, color=ink(LOST), linewidth=0.0, zorder=0.0)


def range_of(values: FloatArray) -> tuple[float, float] | None:
    """Return a range in which noise about a constant is a straight line; None for matplotlib's default."""
    known = values[np.isfinite(values)]
    if not len(known):
        return -1.0, 1.0
    size = float(np.abs(known).max())
    if np.ptp(known) <= ROUND_OFF * size:
        middle, half = float(known.mean()), 0.5 * size or 1.0
        return middle - half, middle + half
    return shown_range(known, 0.0)


def _legend(axes: Axes, shown: Overlay, panel: Sequence[str], centre: float = 0.0) -> None:
    """Write the names of the curves above their panel; in a polar plot with the unit, and the value of the centre."""
    handles, labels = axes.get_legend_handles_labels()
    if shown.polar:
        unit = shown.unit(panel[0])[0]
        labels = [labelled(label, unit) for label in labels]
        if centre < 0.0:
            labels[-1] += f" (grey circle: 0; centre: {centre:.3g})".replace("-", "\N{MINUS SIGN}")
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.06 if shown.polar else 1.0)}
    made = axes.legend(
        handles, labels, ncols=_LEGEND_COLUMNS, frameon=False, fontsize=SMALL, borderaxespad=0.2, borderpad=0.2,
        labelspacing=0.3, handlelength=1.6, labelcolor=ink(GREY), **where,
    )  # fmt: skip
    for text in made.get_texts():
        text.set_parse_math(False)


def curve_colour(index: int) -> palette.Colour:
    """Return the colour of a curve by its number, visible on white paper."""
    order = (5, 4, 2, 3, 0, 1)
    turn, place = divmod(index, len(order))
    colour = palette.on_white(palette.BODIES[order[place]])
    paler = palette.on_white(palette.body(2 * len(palette.BODIES) + order[place]))
    return (colour, palette.darker(colour), paler)[min(turn, 2)]


def values_of(run: Run, column: str) -> FloatArray:
    """Return a column as numbers: NaN where a sample has none; inputs and counts are known at all samples."""
    values = np.asarray(run[column], dtype=float)
    if column in run.input_names or column in ("time", "solver.status", "solver.iterations"):
        return values
    return np.where(run.good, values, np.nan)


def radial_scale(axes: Any, curves: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Give polar axes their scale for curves (angles [rad], values), and return the value of the centre.

    That is 0; if there are negative values it lies below them, and a circle shows 0.
    """
    from matplotlib.ticker import MaxNLocator

    grey = ink(GREY)
    axes.tick_params(labelsize=SMALL, labelcolor=grey)
    axes.grid(linewidth=0.5, color=ink(LIGHT))
    axes.spines["polar"].set(linewidth=0.6, color=grey)
    known = np.concatenate([values[np.isfinite(values)] for _, values in curves])
    if not len(known):
        return 0.0
    low, high = float(known.min()), float(known.max())
    size = (high - min(low, 0.0)) or abs(high) or 1.0
    centre = 0.0 if low >= 0.0 else low - _ROOM * size
    top = high + 0.05 * (high - centre)
    axes.set_rlim(centre, top)
    ticks = np.asarray(MaxNLocator(5).tick_values(centre, top))
    ticks = ticks[(ticks > centre + _INNERMOST * (top - centre)) & (ticks < top)]
    axes.set_yticks(ticks)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value + 0.0:.4g}".replace("-", "\N{MINUS SIGN}"))
    if low < 0.0:
        around = np.linspace(0.0, 2.0 * np.pi, 181)
        axes.plot(around, np.zeros(len(around)), linewidth=0.9, color=grey, label="_", zorder=2.05)  # over the grid
    drawn = np.concatenate([(values - centre) * np.exp(1j * angles) for angles, values in curves])
    drawn = drawn[np.isfinite(drawn)]
    spots = (ticks[:, None] - centre) * np.exp(1j * _PLACES)  # (ticks, places)
    apart = np.abs(spots[:, :, None] - drawn[None, None, :: max(len(drawn) // 500, 1)]).min(axis=(0, 2))
    axes.set_rlabel_position(float(np.degrees(_PLACES[int(np.argmax(np.round(apart / size, 6)))])))
    return centre
