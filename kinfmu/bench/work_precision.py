"""A work-precision chart: time of a sample against its largest error, one panel a mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kinfmu.draw.chart import SMALL, Look, dress, named
from kinfmu.draw.sheet import FONT, GREY, INCH, ink
from kinfmu.draw.writing import write
from kinfmu.scene.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR, TOP = 1e-17, 10.0  # relative errors that are shown; what is smaller is drawn at the floor
LEFT = 1e-20  # where the axis begins: room for a name beside a point of round-off
_WIDTH, _HEIGHT = 760.0, 300.0  # [pt], of a row of panels
_COLUMNS = 3
_SHADES = (1.0, 0.62, 0.36)  # of a curve's colour: its engine's highest order of the predictor, and those below
_ABOVE, _BELOW = 1e-6, 2e-12  # errors at which a curve's name stands: names of two neighbours do not meet
_NEAR = 0.05  # decades of time between curves that a name cannot part
_SCALE = {
    1e-3: "1 ns",
    1e-2: "10 ns",
    0.1: "100 ns",
    1.0: "1 µs",
    10.0: "10 µs",
    100.0: "100 µs",
    1e3: "1 ms",
    1e4: "10 ms",
    1e5: "100 ms",
}


class Curve(NamedTuple):
    """Points (largest error, microseconds a sample) of one engine with one predictor, from rough to fine."""

    engine: str
    order: int
    points: Sequence[tuple[float, float]]


class Panel(NamedTuple):
    """What was measured on one mechanism."""

    title: str
    curves: Sequence[Curve]


def work_precision(
    paths: tuple[Path, ...], panels: Sequence[Panel], looks: Mapping[str, Look], notes: Sequence[str]
) -> None:
    """Draw the chart into .svg or .png files; looks: of the engines; notes: how to read it, beside the last panel.

    Raises FigureError, MissingPackageError as `draw.writing.write` does.
    """
    write(paths, lambda: _chart(panels, looks, notes))


def _chart(panels: Sequence[Panel], looks: Mapping[str, Look], notes: Sequence[str]) -> Figure:
    from matplotlib.figure import Figure

    rows = -(-(len(panels) + 1) // _COLUMNS)
    height = rows * _HEIGHT
    made = Figure(figsize=(_WIDTH / INCH, height / INCH), dpi=INCH, facecolor="white")
    grid = made.add_gridspec(
        rows, _COLUMNS, left=0.065, right=0.985, top=1 - 26 / height, bottom=36 / height, wspace=0.1, hspace=0.28
    )
    times = [time for panel in panels for curve in panel.curves for _, time in curve.points]
    for k, panel in enumerate(panels):
        axes = made.add_subplot(grid[k // _COLUMNS, k % _COLUMNS])
        _panel(axes, panel, looks, (min(times) / 4.0, max(times) * 2.5))
        axes.tick_params(labelleft=k % _COLUMNS == 0)
        if k + _COLUMNS >= len(panels):
            axes.set_xlabel("largest relative error of q, qd, qdd", fontsize=SMALL, color=ink(GREY), labelpad=2.0)
    _notes(made.add_subplot(grid[len(panels) // _COLUMNS, len(panels) % _COLUMNS]), notes)
    return made


def _panel(axes: Axes, panel: Panel, looks: Mapping[str, Look], times: tuple[float, float]) -> None:
    dress(axes, panel.title)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(LEFT, TOP)
    axes.set_ylim(*times)
    axes.set_xticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0])
    ticks = {time: word for time, word in _SCALE.items() if times[0] <= time <= times[1]}
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.minorticks_off()
    shown = {
        engine: [curve for curve in panel.curves if curve.engine == engine]
        for engine in dict.fromkeys(curve.engine for curve in panel.curves)
    }
    for engine, curves in shown.items():
        look = looks[engine]
        highest = max(curve.order for curve in curves)
        for curve in curves:
            x = [min(max(error, FLOOR), TOP) for error, _ in curve.points]
            colour = _lighter(look.colour, _SHADES[highest - curve.order])
            size = 3.2 if len(x) > 1 else 5.5
            level = 3.0 + curve.order + (5.0 if len(x) == 1 else 0.0)
            y = [time for _, time in curve.points]
            axes.plot(x, y, color=colour, linewidth=look.width, marker=look.marker, markersize=size, zorder=level)
    for engine, curves in shown.items():
        _name(
            axes, engine, looks[engine].colour, curves, [c for other in shown if other != engine for c in shown[other]]
        )


def _lighter(colour: Colour, part: float) -> tuple[float, float, float]:
    """A colour mixed with white."""
    red, green, blue = (1.0 - part * (1.0 - value) for value in ink(colour))
    return red, green, blue


def _name(axes: Axes, engine: str, colour: Colour, curves: Sequence[Curve], others: Sequence[Curve]) -> None:
    """Write the engine's name above or below its curves, where there is more space.

    For single points it is to the left of the slowest, and below the others.
    """
    points = [point for curve in curves for point in curve.points]
    if len(points) == 1:
        ((error, time),) = points
        is_slowest = all(curve.points[0][1] <= time for curve in others if len(curve.points) == 1)
        place = {"offset": (-7.0, -3.0), "ha": "right"} if is_slowest else {"offset": (0.0, -15.0), "ha": "center"}
        named(axes, (max(error, FLOOR), time), engine, colour, **place)
        return
    mine = [height for curve in curves for height in _heights(curve)]
    theirs = [height for curve in others for height in _heights(curve)]
    above = min((height - max(mine) for height in theirs if height > max(mine) - _NEAR), default=9.0)
    below = min((min(mine) - height for height in theirs if height < min(mine) + _NEAR), default=9.0)
    upward = above >= min(below, 0.3)
    x, at, offset = (_ABOVE, max(mine), (0.0, 6.0)) if upward else (_BELOW, min(mine), (0.0, -13.0))
    named(axes, (x, 10.0**at), engine, colour, offset=offset, ha="center")


def _heights(curve: Curve) -> list[float]:
    """log10 of the times of a curve along the names, or at its end that is nearest; nothing for a single point."""
    if len(curve.points) < 2:
        return []
    errors, times = np.log10(sorted((max(error, FLOOR), time) for error, time in curve.points)).T
    return [float(np.interp(x, errors, times)) for x in np.linspace(math.log10(_BELOW), math.log10(_ABOVE) + 2.5, 6)]


def _notes(axes: Axes, notes: Sequence[str]) -> None:
    axes.set_axis_off()
    axes.text(
        0.04, 0.98, "\n".join(notes), fontsize=FONT - 0.5, va="top", color=ink(GREY), linespacing=1.5, parse_math=False
    )
