"""A chart of errors through a singular point: toward it, exactly at it and beyond, one panel a quantity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from kinfmu.draw.chart import LIGHT, SMALL, Look, dress, named
from kinfmu.draw.sheet import GREY, INCH, ink
from kinfmu.draw.writing import write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FLOOR, TOP = 3e-17, 3e10  # errors that are shown; what is smaller is drawn at the floor
QUANTITIES = ("q", "qd", "qdd")
_WIDTH, _HEIGHT = 760.0, 235.0  # [pt], of a row of panels
_GAP = 0.75  # decades between the nearest sample and the point itself


class Passage(NamedTuple):
    """Errors (3, k) of q, qd, qdd of one engine at each distance before a point, at it (3,), and beyond it.

    NaN where the engine gave no numbers.
    """

    engine: str
    before: Sequence[Sequence[float]]
    at: Sequence[float]
    beyond: Sequence[Sequence[float]]


class ChartRow(NamedTuple):
    """What was measured at one singular point; distances: [rad], falling."""

    title: str
    distances: Sequence[float]
    passages: Sequence[Passage]


def near_singular(paths: tuple[Path, ...], rows: Sequence[ChartRow], looks: Mapping[str, Look]) -> None:
    """Draw the chart into .svg or .png files; looks: of the engines.

    Raises FigureError, MissingPackageError as `draw.writing.write` does.
    """
    write(paths, lambda: _chart(rows, looks))


def _chart(rows: Sequence[ChartRow], looks: Mapping[str, Look]) -> Figure:
    from matplotlib.figure import Figure

    height = _HEIGHT * len(rows)
    made = Figure(figsize=(_WIDTH / INCH, height / INCH), dpi=INCH, facecolor="white")
    grid = made.add_gridspec(
        len(rows), 3, left=0.06, right=0.895, top=1.0 - 26.0 / height, bottom=38.0 / height, wspace=0.12, hspace=0.42
    )
    for i, row in enumerate(rows):
        for order, quantity in enumerate(QUANTITIES):
            axes = made.add_subplot(grid[i, order])
            dress(axes, f"{row.title}: {quantity}" if order == 0 else quantity)
            _panel(axes, row, order, looks, is_last=order == len(QUANTITIES) - 1)
            if order == 0:
                axes.set_ylabel("largest error", fontsize=SMALL, color=ink(GREY), labelpad=2.0)
            if i == len(rows) - 1:
                axes.set_xlabel("before   |   distance [rad]   |   beyond", fontsize=SMALL, color=ink(GREY))
    return made


def _panel(axes: Axes, row: ChartRow, order: int, looks: Mapping[str, Look], *, is_last: bool) -> None:
    places = [math.log10(distance) for distance in row.distances]  # -1 ... -8
    nearest = min(places)
    x = [nearest - _GAP - place for place in places]
    axes.axvline(0.0, color=ink(LIGHT), linewidth=6.0, zorder=1.0)
    ends = []
    for passage in row.passages:
        look = looks[passage.engine]
        level = 2.0 + look.width  # the boldest on top
        y = [*passage.before[order], passage.at[order], *reversed(passage.beyond[order])]
        shown = [min(max(value, FLOOR), TOP) for value in y]  # NaN stays
        axes.plot(
            [*x, 0.0, *(-place for place in reversed(x))],
            shown,
            color=ink(look.colour),
            linewidth=look.width,
            zorder=level,
        )
        axes.plot([0.0], [shown[len(x)]], color=ink(look.colour), marker=look.marker, markersize=4.0, zorder=level)
        ends.append((shown[-1], passage.engine, look))
    axes.set_yscale("log")
    axes.set_ylim(FLOOR / 3.0, TOP * 3.0)
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
    if is_last:
        _names(axes, ends, -x[0])


def _names(axes: Axes, ends: list[tuple[float, str, Look]], x: float) -> None:
    """Names at the right ends of the curves, moved apart where they would lie on one another."""
    apart = 1.75  # decades
    height = -math.inf
    known = [(FLOOR if math.isnan(value) else value, engine, look) for value, engine, look in ends]
    for value, engine, look in sorted(known):
        height = max(math.log10(value), height + apart)
        named(axes, (x, 10.0**height), engine, look.colour, offset=(6.0, -3.0), annotation_clip=False)
