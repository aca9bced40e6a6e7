"""Draw tubes and cells of a certificate, and Krawczyk's test in one of them: `python -m tests.docs.certified FILE`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import kinfmu
from kinfmu import Certificate
from kinfmu.analysis.certified.intervals import Intervals
from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.overlay import curve_colour
from kinfmu.draw.sheet import GREY, ink
from kinfmu.draw.writing import write

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE, ORANGE = (ink(curve_colour(k)) for k in (0, 1))
WIDTH = 0.6  # [rad] of a cell, for tubes that are seen
SHOWN = 2  # the cell of the second panel
NAME = "rocker.phi"


def _draw_tubes(axes: Axes, certificate: Certificate) -> None:
    """Draw the tubes in which a pose is the only one, those in which it is, and the cells."""
    cells, tubes = certificate.cover.cells, certificate.cover.tubes
    number = list(certificate.prover.formulas.unknowns).index(NAME)
    for k in range(len(cells)):
        u = np.linspace(cells.low[k], cells.high[k], 9)
        path = np.concatenate([cells[k : k + 1].at(Intervals(x) - cells.u[k]).middle[number] for x in u[:, None]])
        for tube, shade in ((tubes.wide, 0.25), (tubes.narrow, 0.5)):
            low, high = tube.low[number, k], tube.high[number, k]
            axes.fill_between(u, path + low, path + high, color=BLUE, alpha=shade, linewidth=0.0)
        axes.axvline(cells.high[k], color=ink(GREY), linewidth=0.4)
    u = np.linspace(certificate.low, certificate.high, 90)
    low, high = certificate.enclosed(NAME, u)
    axes.plot(u, 0.5 * (low + high), color=BLUE, linewidth=0.8)
    axes.set(xlabel="crank [rad]", ylabel="rocker [rad]", xlim=(certificate.low, certificate.high))


def _draw_test(axes: Axes, certificate: Certificate) -> None:
    """Draw W and K(W) of one cell."""
    tubes = certificate.cover.tubes
    for tube, colour, text in ((tubes.wide, BLUE, "W"), (tubes.narrow, ORANGE, "K(W)")):
        (left, bottom), (right, top) = tube.low[:, SHOWN], tube.high[:, SHOWN]
        box = Rectangle((left, bottom), right - left, top - bottom, alpha=0.3, facecolor=colour, edgecolor=colour)
        axes.add_patch(box)
        axes.annotate(text, (right, top), ha="right", va="top", color=colour, fontsize=SMALL + 1.0)
    reach = 1.15 * float(tubes.wide.high[:, SHOWN].max())
    axes.set(xlabel="deviation of the coupler [rad]", ylabel="deviation of the rocker [rad]")
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.plot(0.0, 0.0, "+", color=ink(GREY), markersize=5.0)


def chart() -> Figure:
    """Draw the certificate of the crank-rocker with wide cells."""
    certificate = kinfmu.certify(kinfmu.load("crank_rocker"), width=WIDTH)
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    dress(left, "Tubes around the motion of the rocker")
    dress(right, f"Krawczyk's test in cell {SHOWN + 1}")
    for axes in (left, right):
        axes.grid(visible=False)
    _draw_tubes(left, certificate)
    _draw_test(right, certificate)
    for axes in (left, right):
        for axis in (axes.xaxis, axes.yaxis):
            axis.label.set(size=SMALL, color=ink(GREY))
    return figure


def main() -> None:
    """Write the figure."""
    write(Path(sys.argv[1]), chart)


if __name__ == "__main__":
    main()
