"""svaj(): displacement, velocity, acceleration and jerk of a follower or a slider over its driver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL, Abscissa, abscissa, degree_ticks, dress, labelled, numbers, rows_of
from kinfmu.draw.overlay import curve_colour, range_of, sheet_title
from kinfmu.draw.sheet import GREY, TITLE_EDGE, TITLE_LINE, ink, title_lines, titled_figure
from kinfmu.draw.writing import check_suffix, write
from kinfmu.errors import FigureError
from kinfmu.motion.motion_curve import MotionCurve, motion_curve, units_of
from kinfmu.run import Run
from kinfmu.units import degrees_of, unit_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LETTERS = ("s", "v", "a", "j")
_COLOURS = (0, 2, 1, 3)  # of curves
_WIDTH, _HEIGHT = 420.0, 104.0  # [pt] of a panel
_LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 70.0, 24.0, 34.0, 34.0, 12.0  # [pt]


def svaj(run: Run, path: str | Path, name: str, *, degrees: bool = False) -> None:
    """Draw displacement s, velocity v, acceleration a and jerk j of a coordinate or a cam's follower over its driver.

    The jerk is exact: it solves the constraint equations, differentiated three times, at every sample and on both sides
    of each break of a law, where it jumps. It has gaps at samples that are bridged or near a singular point. v, a and j
    are derivatives by time or by the driver, as the rates of the run are; their units state it.

    Args:
        run: The run.
        path: The .svg, .png or .pdf file.
        name: A coordinate such as 'slider.x' or 'foot.y', or the name of a cam joint for its lift.
        degrees: True: angles in deg.

    Raises:
        RequestError: The name is unknown, or the jerk is not known, with the reason.
        FigureError: The run has no samples, the suffix is unknown, or the file cannot be written.
        MissingPackageError: matplotlib is not installed.

    """
    path = Path(str(path))
    check_suffix(path)
    if not len(run):
        raise FigureError("the run has no samples to plot")
    curve = motion_curve(run, name)
    units = units_of(run, curve)
    rows = curve.drawn()
    across = driver_axis(run, curve)
    across = replace(across, values=across.values[rows])
    write(path, lambda: _sheet(run, across, name, curve.table[rows], units, degrees=degrees))


def driver_axis(run: Run, curve: MotionCurve) -> Abscissa:
    """Return the values (m,) of the only driver that moves, or of the axis of the run, along a curve."""
    moving = [k for k in range(0, len(run.input_names), 3) if np.ptp(run.inputs[:, k]) > 0.0]
    if len(moving) == 1:
        driven = run.input_names[moving[0]]
        unit, factor = degrees_of(unit_of(driven.quantity, run.length_unit))
        return Abscissa(driven.driver, unit, curve.drive[:, moving[0] // 3] * factor, False)
    along = abscissa(run)
    return replace(along, values=np.interp(curve.place, np.arange(len(run)), along.values))


def _sheet(run: Run, across: Abscissa, name: str, table: FloatArray, units: list[str], *, degrees: bool) -> Figure:
    width = _LEFT + _WIDTH + _RIGHT
    title = sheet_title((run,), ("", ""))
    lines = title_lines(f"{title}: {name}" if title else name, width - 2.0 * TITLE_EDGE)
    above = _TOP + max(len(lines) - 1, 0) * TITLE_LINE
    height = above + 4.0 * _HEIGHT + 3.0 * _GAP + _BOTTOM
    made = titled_figure(width, height, lines)
    for order, letter in enumerate(LETTERS):
        bottom = height - above - (order + 1) * _HEIGHT - order * _GAP
        axes = made.add_axes((_LEFT / width, bottom / height, _WIDTH / width, _HEIGHT / height))
        unit, factor = degrees_of(units[order]) if degrees else (units[order], 1.0)
        values = table[:, order] * factor
        rows = rows_of(values)
        axes.plot(across.values[rows], values[rows], linewidth=1.2, color=ink(curve_colour(_COLOURS[order])))
        dress(axes, "")
        limits = range_of(values)
        if limits:
            axes.set_ylim(*limits)
        axes.margins(x=0.01)
        axes.locator_params(axis="y", nbins=4)
        unit = numbers(axes, unit)
        if across.is_angle:
            degree_ticks(axes.xaxis, 9)
        axes.set_ylabel(labelled(letter, unit), fontsize=SMALL, color=ink(GREY))
        axes.yaxis.set_label_coords(-50.0 / _WIDTH, 0.5)
        axes.tick_params(labelbottom=order == len(LETTERS) - 1)
    axes.set_xlabel(across.label, fontsize=SMALL, color=ink(GREY), labelpad=1.0, parse_math=False)
    return made
