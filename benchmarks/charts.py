"""Charts of what was measured: run time against error, and errors through singular points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.accuracy import Measured
from benchmarks.singular import DISTANCES, Near
from kinfmu.draw.chart import LIGHT, SMALL, Look, dress, named
from kinfmu.draw.scene.palette import BODIES, GROUND, LOAD, Colour, darker
from kinfmu.draw.sheet import GREY, INCH, ink
from kinfmu.draw.writing import write
from kinfmu.mechanism import gallery
from kinfmu.plan import compile_plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORK_PRECISION, NEAR_SINGULAR = "accuracy-work-precision", "accuracy-singular"
SUFFIXES = (".svg", ".png")
POINTS = 2  # singular points in their chart; the table has them all
QUANTITIES = ("q", "qd", "qdd")
NOTES = (
    "To the left is exact, below is fast.",
    "",
    "Points of the readable reference: 0 to 3",
    "corrections of Newton; of the others:",
    "tolerances.",
    "",
    "Curves from light to dark: predicted by the",
    "last pose, with its velocity, with velocity",
    "and acceleration.",
    "",
    "kinfmu is what is shipped: the last, with every",
    "step judged, to round-off; native in C.",
)
LOOKS = {  # of the engines
    "kinfmu": Look(BODIES[4], 2.2, "D"),
    "kinfmu native": Look(darker(BODIES[4]), 2.2, "D"),
    "generated Python": Look(BODIES[0]),
    "pylinkage": Look(GROUND, 1.4, "s"),
    "kimech": Look(LOAD, 1.4, "s"),
    "CasADi": Look(BODIES[3]),
    "scipy fsolve": Look(BODIES[2]),
    "numpy Newton": Look(BODIES[1], 1.4, "s"),
    "readable reference": Look(BODIES[5]),
}
_WIDTH = 760.0  # [pt]
_TIMES = {  # [us], of the scale of times
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
_SHADES = (1.0, 0.62, 0.36)  # of an engine's colour: the highest order of its predictor, and those below
_GAP = 0.75  # decades between the sample nearest to a singular point and the point itself
_APART = 1.75  # decades between the names of two curves


def draw(folder: Path, measured: Sequence[Measured], near: Sequence[Near]) -> tuple[Path, ...]:
    """Write both charts into a folder, as SVG and PNG, and return their paths.

    Raises FigureError, MissingPackageError as `draw.writing.write` does.
    """
    first, second = (
        tuple(folder / f"{name}{suffix}" for suffix in SUFFIXES) for name in (WORK_PRECISION, NEAR_SINGULAR)
    )
    write(first, lambda: work_precision(measured))
    write(second, lambda: near_singular([one for one in near if one.point in _points(near)[:POINTS]]))
    return first + second


# ------------------------------------------------------------------------------------------- run time against error


def work_precision(measured: Sequence[Measured]) -> Figure:
    """Draw times against errors, one panel a mechanism, and how to read them next to the last one.

    A curve is one engine with one predictor: its fixed numbers of corrections, or tolerances if it has none.
    """
    from matplotlib.figure import Figure

    cases = list(dict.fromkeys(one.case for one in measured))
    columns = 3
    rows = -(-(len(cases) + 1) // columns)
    height = 300.0 * rows  # [pt]
    made = Figure(figsize=(_WIDTH / INCH, height / INCH), dpi=INCH, facecolor="white")
    grid = made.add_gridspec(
        rows, columns, left=0.065, right=0.985, top=1 - 26 / height, bottom=36 / height, wspace=0.1, hspace=0.28
    )
    times = [one.microseconds.median for one in measured]
    low, high = min(times) / 2.5, max(times) * 2.5
    ticks = {time: word for time, word in _TIMES.items() if low <= time <= high}
    for k, case in enumerate(cases):
        axes = made.add_subplot(grid[k // columns, k % columns])
        dress(axes, _title(case))
        _time_panel(axes, [one for one in measured if one.case == case])
        axes.set_ylim(low, high)
        axes.set_yticks(list(ticks), list(ticks.values()))
        axes.minorticks_off()
        axes.tick_params(labelleft=k % columns == 0)
        if k + columns >= len(cases):
            axes.set_xlabel("largest relative error of q, qd, qdd", fontsize=SMALL, color=ink(GREY), labelpad=2.0)
    _notes(made.add_subplot(grid[len(cases) // columns, len(cases) % columns]), measured)
    return made


def _title(case: str) -> str:
    """Return a mechanism's name with its unknowns in the order of solving: 'jansen leg: 2 + 2 + 2 unknowns'."""
    sizes = [len(block.unknowns) for block in compile_plan(gallery.load(case)).blocks if block.unknowns]
    return f"{case.replace('_', ' ')}: {' + '.join(map(str, sizes))} unknown{'s' * (sizes != [1])}"


def _time_panel(axes: Axes, measured: Sequence[Measured]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for engine, look in LOOKS.items():
        found = [one for one in measured if one.engine == engine and not one.setting.chord and math.isfinite(one.error)]
        found = [one for one in found if one.setting.corrections is not None] or found
        orders = sorted({one.setting.predictor for one in found})
        for order in orders:
            line = [one for one in found if one.setting.predictor == order]
            axes.plot(
                [_within(one.error, 1e-17, 10.0) for one in line],
                [one.microseconds.median for one in line],
                color=_lighter(look.colour, _SHADES[orders[-1] - order]),
                linewidth=look.width,
                marker=look.marker,
                markersize=3.2 if len(line) > 1 else 5.5,
                zorder=3.0 + order + (5.0 if len(line) == 1 else 0.0),
            )
    axes.set_xlim(1e-18, 10.0)
    axes.set_xticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0])


def _lighter(colour: Colour, part: float) -> tuple[float, float, float]:
    """Return a colour mixed with white."""
    red, green, blue = (1.0 - part * (1.0 - value) for value in ink(colour))
    return red, green, blue


def _notes(axes: Axes, measured: Sequence[Measured]) -> None:
    """Write the names of the engines, the slowest first as in the panels, and how to read the chart."""
    from matplotlib.lines import Line2D

    times = {one.engine: one.microseconds.median for one in measured if one.is_usual}
    handles = []
    for name in sorted(times, key=lambda name: -times[name]):
        colour, width, marker = LOOKS[name]
        handles.append(Line2D([], [], color=ink(colour), linewidth=width, marker=marker, label=name))
    axes.set_axis_off()
    axes.legend(
        handles=handles, loc="upper left", frameon=False, fontsize=SMALL, labelcolor="linecolor", labelspacing=0.3
    )
    text = "\n".join(NOTES)
    axes.text(0.04, 0.0, text, fontsize=SMALL, va="bottom", color=ink(GREY), linespacing=1.3, parse_math=False)


# ------------------------------------------------------------------------------------ errors through singular points


def near_singular(near: Sequence[Near]) -> Figure:
    """Draw errors toward each singular point, exactly at it and beyond, one row a point and one panel a quantity."""
    from matplotlib.figure import Figure

    points = _points(near)
    height = 235.0 * len(points)  # [pt]
    made = Figure(figsize=(_WIDTH / INCH, height / INCH), dpi=INCH, facecolor="white")
    grid = made.add_gridspec(
        len(points), 3, left=0.06, right=0.895, top=1.0 - 26.0 / height, bottom=38.0 / height, wspace=0.12, hspace=0.42
    )
    for i, point in enumerate(points):
        for order, quantity in enumerate(QUANTITIES):
            axes = made.add_subplot(grid[i, order])
            dress(axes, quantity if order else f"{point}: {quantity}")
            _error_panel(axes, [one for one in near if one.point == point], order)
            if order == 0:
                axes.set_ylabel("largest error", fontsize=SMALL, color=ink(GREY), labelpad=2.0)
            if i == len(points) - 1:
                axes.set_xlabel("before   |   distance [rad]   |   beyond", fontsize=SMALL, color=ink(GREY))
    return made


def _points(near: Sequence[Near]) -> list[str]:
    return list(dict.fromkeys(one.point for one in near))


def _error_panel(axes: Axes, near: Sequence[Near], order: int) -> None:
    low, high = 3e-17, 3e10  # errors that are shown; those outside are drawn at the ends
    places = [math.log10(distance) for distance in DISTANCES]  # -1 ... -8
    nearest = min(places)
    x = [nearest - _GAP - place for place in places]
    axes.axvline(0.0, color=ink(LIGHT), linewidth=6.0, zorder=1.0)
    ends = []
    for one in near:
        look = LOOKS[one.engine]
        level = 2.0 + look.width  # the boldest on top
        errors = [*one.before[:, order], one.at[order], *one.beyond[::-1, order]]
        y = [_within(float(error), low, high) for error in errors]
        colour = ink(look.colour)
        axes.plot([*x, 0.0, *(-place for place in reversed(x))], y, color=colour, linewidth=look.width, zorder=level)
        axes.plot([0.0], [y[len(x)]], color=colour, marker=look.marker, markersize=4.0, zorder=level)
        ends.append((low if math.isnan(y[-1]) else y[-1], one.engine))
    axes.set_yscale("log")
    axes.set_ylim(low / 3.0, high * 3.0)
    axes.set_yticks([1e-16, 1e-12, 1e-8, 1e-4, 1.0, 1e4, 1e8])
    axes.minorticks_off()
    if order:
        axes.tick_params(labelleft=False)
    ticks = [place for place in places if abs(place - round(place)) < 1e-9 and round(place) % 2]
    left = [nearest - _GAP - place for place in ticks]
    axes.set_xticks([*left, 0.0, *(-place for place in reversed(left))])
    words = [f"$10^{{{round(place)}}}$" for place in ticks]
    axes.set_xticklabels([*words, "0", *reversed(words)])
    axes.set_xlim(x[0] - 0.3, -x[0] + 0.3)
    if order == len(QUANTITIES) - 1:  # names at the right ends, moved apart where they would lie on one another
        decade = -math.inf
        for error, engine in sorted(ends):
            decade = max(math.log10(error), decade + _APART)
            at = (-x[0], 10.0**decade)
            named(axes, at, engine, LOOKS[engine].colour, offset=(6.0, -3.0), annotation_clip=False)


def _within(error: float, low: float, high: float) -> float:
    """Return an error that is not off the scale; NaN stays."""
    return min(max(error, low), high)
