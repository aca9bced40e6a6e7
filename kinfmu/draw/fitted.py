"""Figure of a fitted mechanism: what was wanted and what is reached, and the mechanism at one pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.names import Mark, Name
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.sheet import INCH, Sheet, ink
from kinfmu.draw.writing import check_target, write
from kinfmu.mechanism import Mechanism

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WANTED: Colour = (185, 28, 28)
REACHED: Colour = (29, 78, 137)
_SIDE, _HEIGHT = 460.0, 391.0  # [pt], of a panel
_MARKER, _LEAST_MARKER = 6.0, 2.5  # [pt], sizes of wanted points
_NEAR = 2.0  # markers; a path whose points are nearer to one another in the drawing has a panel of its own


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

    path: The .svg or .png file. ax: Axes to draw into, in place of a file: the mechanism and curves, or the first chart
    without curves. content: Returns what is drawn.

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
    """Return the figure of matplotlib: the mechanism with the curves, paths that are small in it, and the charts."""
    from matplotlib.figure import Figure

    scratch = Figure(figsize=(_SIDE / INCH, _HEIGHT / INCH), dpi=INCH).subplots()
    small: list[Curve] = []
    if shown.curves:
        _mechanism(scratch, shown)
        small = [curve for curve in shown.curves if _spacing(scratch, curve) < _NEAR * _MARKER]
    count = 1 + len(small) + len(shown.charts)
    made = Figure(figsize=(count * _SIDE / INCH, _HEIGHT / INCH), dpi=INCH, facecolor="white")
    panels = [made.add_subplot(1, count, k + 1) for k in range(count)]
    made.subplots_adjust(left=0.12 / count, right=1.0 - 0.05 / count, bottom=0.11, top=0.9, wspace=0.22)
    _mechanism(panels[0], shown)
    for axes, curve in zip(panels[1:], small, strict=False):
        _enlarged(axes, curve, shown.mechanism.length_unit)
    for axes, chart in zip(panels[1 + len(small) :], shown.charts, strict=True):
        _chart(axes, chart)
    return made


@dataclass(frozen=True, eq=False)
class _CurveToCome(Mark):
    """A curve that is drawn over the mechanism, off which names are kept."""

    curve: Curve

    def extent(self) -> FloatArray:
        points = np.vstack([self.curve.whole, self.curve.wanted])
        return points[np.isfinite(points).all(axis=1)]

    def draw(self, sheet: Sheet) -> list[Name]:
        sheet.cover(self.curve.whole[np.isfinite(self.curve.whole).all(axis=1)], matters=1.0)
        for point in self.curve.wanted:
            sheet.cover(np.array([point, point]), matters=2.0, width=_MARKER)
        return []


def _mechanism(axes: Axes, shown: Fitted) -> None:
    sheet_of(instant(shown.mechanism, shown.at, with_gap=True), axes, [_CurveToCome(curve) for curve in shown.curves])
    if not shown.curves:
        return
    points = np.vstack([curve.wanted for curve in shown.curves])
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = axes.get_xlim(), axes.get_ylim()
    space = 0.03 * max(x[1] - x[0], y[1] - y[0])  # for the marks
    axes.set_xlim(min(x[0], low[0] - space), max(x[1], high[0] + space))
    axes.set_ylim(min(y[0], low[1] - space), max(y[1], high[1] + space))
    for curve in shown.curves:
        _draw(axes, curve, float(np.clip(0.6 * _spacing(axes, curve), _LEAST_MARKER, _MARKER)))
    axes.legend(loc="lower right", fontsize=SMALL, frameon=True, framealpha=0.85, edgecolor="none")


def _spacing(axes: Axes, curve: Curve) -> float:
    """Return the usual distance of a wanted point from the nearest other one on the paper [pt]."""
    apart = np.hypot(*(curve.wanted[:, None] - curve.wanted[None]).transpose(2, 0, 1))
    apart[apart == 0.0] = np.inf  # a point itself, and the same one wanted twice
    nearest = apart.min(axis=1, initial=np.inf)
    if not np.isfinite(nearest).any():
        return np.inf
    box = axes.get_window_extent()
    scale = min(box.width / np.ptp(axes.get_xlim()), box.height / np.ptp(axes.get_ylim()))
    return float(np.median(nearest[np.isfinite(nearest)]) * scale * INCH / axes.figure.dpi)


def _enlarged(axes: Axes, curve: Curve, unit: str) -> None:
    """Draw one path alone, with equal scales, over the range of its points."""
    dress(axes, f"{curve.name}, enlarged")
    _draw(axes, curve)
    points = np.vstack([curve.wanted, curve.reached])
    low, high = points.min(axis=0), points.max(axis=0)
    space = 0.12 * float((high - low).max())
    axes.set_xlim(low[0] - space, high[0] + space)
    axes.set_ylim(low[1] - space, high[1] + space)
    axes.set_aspect("equal", adjustable="box")
    _label(axes, f"x [{unit}]", f"y [{unit}]")


def _chart(axes: Axes, chart: Chart) -> None:
    dress(axes, chart.curve.name)
    _draw(axes, chart.curve)
    _label(axes, *chart.labels)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=SMALL)
    axes.set_ylabel(y, fontsize=SMALL)
    axes.legend(loc="best", fontsize=SMALL, frameon=True, framealpha=0.85, edgecolor="none")


def _draw(axes: Axes, curve: Curve, marker: float = _MARKER) -> None:
    """Draw the curve, its points, the wanted points with a size of `marker` [pt], and lines between both."""
    axes.plot(*curve.whole.T, color=ink(REACHED), linewidth=1.6, zorder=900.0, label=f"{curve.name}: reached")
    for wanted, reached in zip(curve.wanted, curve.reached, strict=True):
        axes.plot(*np.array([wanted, reached]).T, color=ink(WANTED), linewidth=0.8, zorder=901.0)
    axes.plot(*curve.reached.T, ".", color=ink(REACHED), markersize=0.8 * marker, zorder=902.0)
    look: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": ink(WANTED), "markersize": marker}
    look |= {"markeredgewidth": min(1.0, 0.2 * marker), "zorder": 903.0}
    axes.plot(*curve.wanted.T, "o", label=f"{curve.name}: wanted", **look)
