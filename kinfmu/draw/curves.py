"""Curves of a run in Axes of matplotlib, with gaps for samples without numbers; overview(): its outputs."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import abscissa, dress, raised
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import ink
from kinfmu.errors import FigureError, RequestError, suggestion
from kinfmu.run import Run
from kinfmu.units import CoordinateName, degrees_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LOST: palette.Colour = (246, 222, 222)
_BINS = 1500  # of a long run; each shows its least and its greatest value
MOST_CURVES = 4  # of a panel
WIDTH, HEIGHT = 4.4, 2.4  # [in] of a panel


def curves(axes: Axes, run: Run, columns: Sequence[str] = (), x: str = "", *, degrees: bool = False) -> Axes:
    """Draw columns of a run into `axes` and return it; arguments and errors as in `plot` with `ax`."""
    names = _columns(run, columns)
    units = run.column_units()
    for name in names[1:]:
        if units[name] != units[names[0]]:
            raise FigureError(
                f"Axes show one unit, but '{names[0]}' is in {units[names[0]]} and '{name}' in {units[name]}; "
                "name columns of one unit"
            )
    if not len(run) or not names:
        raise FigureError(f"the run has no {'samples' if names else 'coordinates'} to plot")
    across = abscissa(run, x)
    shown, factor = degrees_of(units[names[0]]) if degrees else (units[names[0]], 1.0)
    for name in names:
        values = np.where(run.good, np.asarray(run[name], dtype=float), np.nan) * factor
        rows = np.union1d(rows_of(values), rows_of(across.values))
        is_curve = np.isfinite(values).sum() > 1
        axes.plot(across.values[rows], values[rows], marker="" if is_curve else "o", label=name)
    axes.set_xlabel(across.label)
    unit = raised(shown)
    label = f"{names[0]} [{unit}]" if len(names) == 1 else f"[{unit}]"
    axes.set_ylabel(label if axes.get_ylabel() in ("", label) else f"[{unit}]")
    if len(axes.lines) > 1:
        axes.legend()
    for first, last in gaps(run, across.values) if across.is_axis else ():
        axes.axvspan(first, last, color=ink(LOST), linewidth=0.0, zorder=0.0)
    return axes


def _columns(run: Run, wanted: Sequence[str]) -> list[str]:
    """Return the names of the columns that were asked for."""
    if isinstance(wanted, str):
        raise RequestError(f"columns: '{wanted}' must be a list of names, such as ['{wanted}']")
    known = list(run.column_units())
    names: dict[str, None] = {}
    for name in wanted or run.names or run.outputs:
        found = [column for column in known if fnmatchcase(column, name)]
        if not found:
            run[name]  # reports why: unknown, or not kept
            raise RequestError(f"'{name}' does not move, so there is no curve{suggestion(name, known)}")
        names |= dict.fromkeys(found)
    return list(names)


def rows_of(values: FloatArray) -> NDArray[np.int64]:
    """Return samples that give the same picture as all: of long runs the extremes of short intervals, and gaps."""
    count = len(values)
    if count <= 4 * _BINS:
        return np.arange(count)
    found = [np.array([0, count - 1]), np.flatnonzero(np.diff(np.isfinite(values))) + np.array([[0], [1]])]
    edges = np.linspace(0, count, _BINS + 1).astype(int)
    for first, last in pairwise(edges):
        part = values[first:last]
        if np.isfinite(part).any():
            found.append(first + np.array([np.nanargmin(part), np.nanargmax(part)]))
    return np.unique(np.concatenate([rows.ravel() for rows in found]))


def gaps(run: Run, values: FloatArray) -> list[tuple[float, float]]:
    """Return for each gap the last sample with numbers before it and the first one after it."""
    turns = np.flatnonzero(np.diff(np.r_[True, run.good, True].astype(int)))  # first of a gap, first after it, ...
    last = len(run) - 1
    return [
        (float(values[max(begin - 1, 0)]), float(values[min(end, last)]))
        for begin, end in zip(turns[::2], turns[1::2], strict=True)
    ]


def overview(run: Run) -> Figure:
    """Return a figure of the first outputs of a run with samples, with a panel for each unit; needs matplotlib."""
    from matplotlib.figure import Figure

    by_unit = [[name for name in shown_outputs(run) if name.is_angle == is_angle] for is_angle in (False, True)]
    panels = [names for names in by_unit if names]
    figure = Figure(figsize=(WIDTH * max(len(panels), 1), HEIGHT), layout="constrained", facecolor="white")
    for index, names in enumerate(panels, start=1):
        axes = figure.add_subplot(1, len(panels), index)
        curves(axes, run, names[:MOST_CURVES])
        dress(axes, "")
        axes.set_ylabel("rad" if names[0].is_angle else run.length_unit)
        more = f"and {len(names) - MOST_CURVES} more" if len(names) > MOST_CURVES else None
        axes.legend(
            title=more, fontsize=7.0, title_fontsize=7.0, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0)
        )
    return figure


def shown_outputs(run: Run) -> list[CoordinateName]:
    """Return the outputs that a run holds, points of interest first."""
    outputs = [*run.outputs[run.coordinate_count :], *run.names]
    return [name for name in outputs if name not in run.absent]
