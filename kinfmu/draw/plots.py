"""plot(): coordinates of a run over time or driver values, each with velocity and acceleration, for a report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.curves import LOST, curves, gaps, rows_of
from kinfmu.draw.sheet import FONT, GREY, INCH, INK, TITLE_FONT, TITLE_LINE, ink, title_lines
from kinfmu.draw.writing import check_suffix, check_target, write
from kinfmu.errors import FigureError
from kinfmu.run import FloatArray, Run
from kinfmu.run.axis import ROUND_OFF, Axis, axis_of, shown_range
from kinfmu.run.channels import coordinates
from kinfmu.scene import palette
from kinfmu.units import CoordinateName, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COORDINATES = 30  # more make a sheet too large to print
_ABREAST = 3  # coordinates in a row
_WIDTH, _HEIGHT = 244.0, 96.0  # [pt], of a panel with its margins
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 22.0, 44.0, 34.0  # [pt] around all panels; the last tick has half its number there
_BETWEEN, _GAP, _BLOCK_GAP = 62.0, 14.0, 52.0  # [pt] between coordinates, their panels, and rows of coordinates
_EDGE = 8.0  # [pt] around the title
_LABEL = 40.0  # [pt] from an axis to its name


@overload
def plot(run: Run, path: str | Path, columns: Sequence[str] = (), *, ax: None = None) -> None: ...


@overload
def plot(run: Run, path: None = None, columns: Sequence[str] = (), *, ax: Axes) -> Axes: ...


def plot(
    run: Run, path: str | Path | None = None, columns: Sequence[str] = (), *, ax: Axes | None = None
) -> Axes | None:
    """Draw `run` over its axis, usually time: coordinates into a .svg or .png file, or columns into Axes of matplotlib.

    In a file, each coordinate has three panels: position, velocity and acceleration, in rad and the mechanism's unit of
    length. Samples without numbers are gaps on a tinted background; a panel of a column that was not kept has the text
    "not kept". The same run gives the same bytes. Into Axes, each column is a curve with its name as the label, in your
    settings of matplotlib; several calls draw several runs into the same Axes.

    Args:
        run: The run.
        path: The .svg or .png file.
        columns: Of a file: names such as 'coupler.x', 'coupler.*', 'q' or '-crank.phi', as in tables. Default: all
            generalized coordinates. With `ax`: columns of one unit, such as 'coupler.vx', with * for any letters.
            Default: all generalized coordinates, if they have one unit.
        ax: Axes to draw into, in place of a file.

    Returns:
        `ax`; None for a file.

    Raises:
        RequestError: A name is not a coordinate or, with `ax`, not a column.
        FigureError: There are more than MOST_COORDINATES coordinates, the run has no samples, the suffix is unknown, or
            the file cannot be written; neither or both of `path` and `ax` are given; curves for `ax` have two units.
        MissingPackageError: matplotlib is not installed.

    """
    check_target("plot", path, ax)
    if ax is not None:
        return curves(ax, run, columns)
    path = Path(str(path))
    check_suffix(path)
    names = _chosen(run, columns, path)
    write(path, lambda: _sheet(run, names))
    return None


def _chosen(run: Run, columns: Sequence[str], path: Path) -> tuple[CoordinateName, ...]:
    """Return the names of the coordinates to plot."""
    names = coordinates(run, columns) if columns else run.names or run.outputs
    if len(names) > MOST_COORDINATES:
        raise FigureError(
            f"{path}: {len(names)} coordinates are too many for one sheet, which holds {MOST_COORDINATES}; choose some "
            f"of them by name, such as {names[0]}"
        )
    if not len(run) or not names:
        raise FigureError(f"{path}: the run has no {'samples' if names else 'coordinates'} to plot")
    return names


def _sheet(run: Run, names: Sequence[CoordinateName]) -> Figure:
    from matplotlib.figure import Figure

    axis = axis_of(run)
    abreast = min(len(names), _ABREAST)
    blocks = -(-len(names) // _ABREAST)
    block = 3.0 * _HEIGHT + _BLOCK_GAP
    width = _LEFT + abreast * _WIDTH - _BETWEEN + _RIGHT
    title = title_lines(run.info.get("title") or run.info.get("name") or "", width - 2.0 * _EDGE)
    above = _TOP + max(len(title) - 1, 0) * TITLE_LINE
    height = above + blocks * block - _BLOCK_GAP - _GAP + _BOTTOM
    made = Figure(figsize=(width / INCH, height / INCH), dpi=INCH, facecolor="white")
    look: dict[str, Any] = {"fontsize": TITLE_FONT, "va": "top", "color": ink(INK), "parse_math": False}
    made.text(_EDGE / width, 1.0 - _EDGE / height, "\n".join(title), **look)
    for index, name in enumerate(names):
        row, column = divmod(index, _ABREAST)
        left = _LEFT + column * _WIDTH
        panels: list[Axes] = []
        for order in range(3):
            top = height - above - row * block - order * _HEIGHT
            size = ((_WIDTH - _BETWEEN) / width, (_HEIGHT - _GAP) / height)
            axes = made.add_axes((left / width, (top - _HEIGHT + _GAP) / height, *size))
            panels.append(axes)
            _panel(axes, run, axis, name, order)
        for axes in panels[:2]:
            axes.tick_params(labelbottom=False)
        panels[0].set_title(name, fontsize=FONT + 1.0, loc="left", color=ink(INK), parse_math=False)
        panels[2].set_xlabel(axis.label, fontsize=SMALL, color=ink(GREY), labelpad=1.0)
        for axes in panels:
            axes.yaxis.set_label_coords(-_LABEL / (_WIDTH - _BETWEEN), 0.5)
    return made


def _panel(axes: Axes, run: Run, axis: Axis, name: CoordinateName, order: int) -> None:
    """Draw one curve over the whole run."""
    column = name.derivative(order)
    is_kept = column not in run.absent
    values = np.where(run.good, np.asarray(run[column], dtype=float), np.nan) if is_kept else np.full(len(run), np.nan)
    known = values[np.isfinite(values)]
    rows = rows_of(values)
    colour = ink((palette.BODIES[5], palette.BODIES[2], palette.BODIES[4])[order])
    look: dict[str, Any] = {"color": colour, "linewidth": 1.2, "solid_joinstyle": "round"}
    if len(known) < 2:
        look |= {"marker": "o", "markersize": 3.0}
    axes.plot(axis.values[rows], values[rows], **look)
    dress(axes, "")
    axes.set_xlim(*_span(axis.values))
    shown = _shown(run, axis, name, order, known)
    if shown:
        axes.set_ylim(*shown)
    axes.locator_params(axis="y", nbins=4)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.4g}".replace("-", "\N{MINUS SIGN}"))
    unit = unit_of(name.quantity(order, axis.per), run.length_unit).replace("2", "\N{SUPERSCRIPT TWO}")
    axes.set_ylabel(f"{column.removeprefix(f'{name.owner}.')} [{unit}]", fontsize=SMALL, color=ink(GREY), labelpad=3.0)
    if not is_kept:
        axes.text(0.5, 0.5, "not kept", fontsize=SMALL, ha="center", transform=axes.transAxes, color=ink(GREY))
    for first, last in gaps(run, axis.values):
        axes.axvspan(first, last, color=ink(LOST), linewidth=0.0, zorder=0.0)


def _shown(run: Run, axis: Axis, name: CoordinateName, order: int, known: FloatArray) -> tuple[float, float] | None:
    """Return the range of an axis, so that noise about a constant is a straight line; None for matplotlib's default."""
    if not len(known):
        return -1.0, 1.0
    same_kind = [k for k, other in enumerate(run.outputs) if other.is_angle == name.is_angle]
    positions = run.values[run.good][:, same_kind]
    size = float(np.max(np.abs(positions), initial=0.0, where=np.isfinite(positions)))
    usual = size / (axis.span or 1.0) ** order
    if np.ptp(known) <= ROUND_OFF * np.abs(known).max():
        middle = float(known.mean())
        half = 0.5 * abs(middle) or usual or 1.0
        return middle - half, middle + half
    return shown_range(known, usual)


def _span(t: FloatArray) -> tuple[float, float]:
    first, last = float(t.min()), float(t.max())
    edge = 0.01 * (last - first) or 0.5
    return first - edge, last + edge
