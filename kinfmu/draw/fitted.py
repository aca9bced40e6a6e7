"""Figure of a fitted mechanism: what was wanted and what is reached, and the mechanism at one pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.drawing import figure
from kinfmu.draw.sheet import INCH, ink
from kinfmu.draw.writing import check_target, write
from kinfmu.mechanism import Mechanism
from kinfmu.run import FloatArray
from kinfmu.scene.palette import Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WANTED: Colour = (185, 28, 28)
REACHED: Colour = (29, 78, 137)
_SIDE = 460.0  # [pt], of a panel


class Curve(NamedTuple):
    """A target: wanted points (m, 2), the points reached for them (m, 2), and the whole curve (n, 2)."""

    name: str
    wanted: FloatArray
    reached: FloatArray
    whole: FloatArray


class Chart(NamedTuple):
    """A function as a chart, with the labels of its axes."""

    curve: Curve
    labels: tuple[str, str]


class Fitted(NamedTuple):
    """What the figure of a fit shows.

    mechanism: The mechanism, drawn where its only driver has the value `at`. curves: Paths in its plane. charts:
    Functions; each has a panel of its own.
    """

    mechanism: Mechanism
    at: float | None
    curves: Sequence[Curve]
    charts: Sequence[Chart]


def fitted(path: str | Path | None, ax: Axes | None, content: Callable[[], Fitted]) -> None:
    """Draw a fitted mechanism.

    Args:
        path: The .svg or .png file.
        ax: Axes to draw into, in place of a file: the mechanism and curves, or the first chart without curves.
        content: Returns what is drawn.

    Raises:
        FigureError: As in `figure`.
        MissingPackageError: matplotlib is not installed.

    """
    check_target("figure", path, ax)
    if ax is None:
        write(Path(str(path)), lambda: figure_of(content()))
        return
    shown = content()
    if shown.curves or not shown.charts:
        _mechanism(ax, shown)
    else:
        _chart(ax, shown.charts[0])


def figure_of(shown: Fitted) -> Figure:
    """Return the figure of matplotlib: the mechanism with the curves, and a panel for each chart."""
    from matplotlib.figure import Figure

    count = 1 + len(shown.charts)
    made = Figure(figsize=(count * _SIDE / INCH, 0.85 * _SIDE / INCH), dpi=INCH, facecolor="white")
    panels = [made.add_subplot(1, count, k + 1) for k in range(count)]
    made.subplots_adjust(left=0.12 / count, right=1.0 - 0.05 / count, bottom=0.11, top=0.9, wspace=0.22)
    _mechanism(panels[0], shown)
    for axes, chart in zip(panels[1:], shown.charts, strict=True):
        _chart(axes, chart)
    return made


def _mechanism(axes: Axes, shown: Fitted) -> None:
    figure(shown.mechanism, at=shown.at, ax=axes)
    for curve in shown.curves:
        _draw(axes, curve)
    if shown.curves:
        points = np.vstack([curve.wanted for curve in shown.curves])
        low, high = points.min(axis=0), points.max(axis=0)
        x, y = axes.get_xlim(), axes.get_ylim()
        space = 0.03 * max(x[1] - x[0], y[1] - y[0])  # for the marks
        axes.set_xlim(min(x[0], low[0] - space), max(x[1], high[0] + space))
        axes.set_ylim(min(y[0], low[1] - space), max(y[1], high[1] + space))
        axes.legend(loc="lower right", fontsize=SMALL, frameon=True, framealpha=0.85, edgecolor="none")


def _chart(axes: Axes, chart: Chart) -> None:
    dress(axes, chart.curve.name)
    _draw(axes, chart.curve)
    axes.set_xlabel(chart.labels[0], fontsize=SMALL)
    axes.set_ylabel(chart.labels[1], fontsize=SMALL)
    axes.legend(loc="best", fontsize=SMALL, frameon=True, framealpha=0.85, edgecolor="none")


def _draw(axes: Axes, curve: Curve) -> None:
    """Draw the curve, its points, the wanted points, and lines between both."""
    axes.plot(*curve.whole.T, color=ink(REACHED), linewidth=1.6, zorder=900.0, label=f"{curve.name}: reached")
    for wanted, reached in zip(curve.wanted, curve.reached, strict=True):
        axes.plot(*np.array([wanted, reached]).T, color=ink(WANTED), linewidth=0.8, zorder=901.0)
    axes.plot(*curve.reached.T, ".", color=ink(REACHED), markersize=5.0, zorder=902.0)
    axes.plot(
        *curve.wanted.T,
        "o",
        markerfacecolor="none",
        markeredgecolor=ink(WANTED),
        markersize=6.0,
        zorder=903.0,
        label=f"{curve.name}: wanted",
    )
