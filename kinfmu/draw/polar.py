"""The radial scale of polar plots: where its centre is, its circle of zero, and numbers that keep off the curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.sheet import GREY, ink

_GRID: Colour = (228, 228, 228)
_ROOM = 0.25  # of the range of the values, between the centre and the least value if that is negative
_INNERMOST = 0.15  # of the radius; numbers nearer to the centre would be on one another
_PLACES = np.radians(np.arange(11.25, 360.0, 22.5))  # of the numbers, between the lines of the grid


def radial_scale(axes: Any, curves: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Give polar axes their scale for curves (angles [rad], values), and return the value of the centre.

    That is 0; if there are negative values it lies below them, and a circle shows 0.
    """
    from matplotlib.ticker import MaxNLocator

    grey = ink(GREY)
    axes.tick_params(labelsize=SMALL, labelcolor=grey)
    axes.grid(linewidth=0.5, color=ink(_GRID))
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
