"""Figures of fits: wanted points that lie close together have small markers, and a panel of their own."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.transforms import Bbox

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw.fitted import Curve, Fitted, figure_of
from kinfmu.draw.sheet import INCH


def panels(step: float) -> list[Axes]:
    """Of a fit whose five wanted points are `step` apart [m]."""
    wanted = np.array([0.2, 0.1]) + step * np.column_stack([np.arange(5.0), 0.1 * np.arange(5.0) ** 2])
    found = figure_of(Fitted(kinfmu.load("fourbar"), None, [Curve("P", wanted, wanted, wanted)], []))
    found.draw_without_rendering()
    return list(found.axes)


def markers(axes: Axes) -> tuple[float, float]:
    """Size of the wanted points, and their smallest distance on the paper, both [pt]."""
    (line,) = (line for line in axes.lines if line.get_label() == "P: wanted")
    at = axes.transData.transform(line.get_xydata()) * INCH / axes.figure.dpi
    return line.get_markersize(), min(float(np.hypot(*(b - a))) for a, b in pairwise(at))


def test_points_close_together_are_separate_and_enlarged() -> None:
    drawing, enlarged = panels(0.05)
    size, apart = markers(drawing)
    assert size < 6.0
    assert size < apart
    size, apart = markers(enlarged)
    assert size == 6.0
    assert apart > 30.0
    (x0, y0), (x1, y1) = enlarged.transData.transform([[0.0, 0.0], [0.01, 0.01]])
    assert x1 - x0 == pytest.approx(y1 - y0)
    assert enlarged.get_title(loc="left") == "P, enlarged"
    assert (enlarged.get_xlabel(), enlarged.get_ylabel()) == ("x [m]", "y [m]")
    assert np.ptp(enlarged.get_xlim()) == pytest.approx(1.24 * 0.2)


def test_points_far_apart_need_no_panel() -> None:
    (drawing,) = panels(0.3)
    assert markers(drawing)[0] == 6.0


@pytest.mark.parametrize("name", ["crank_rocker", "jansen_leg", "slider_crank", "watt_six_bar", "double_crank"])
@pytest.mark.few(1)
def test_the_name_of_the_driver_keeps_off_a_curve_through_its_usual_place(name: str) -> None:
    mech = kinfmu.load(name)

    def drawn(curve: FloatArray) -> tuple[Axes, Bbox]:
        made = figure_of(Fitted(mech, 1.0, [Curve("path", curve[:2], curve[:2], curve)], []))
        FigureCanvasAgg(made).draw()
        (text,) = (text for text in made.axes[0].texts if text.get_text().startswith(f"{mech.drivers[0].name} = "))
        return made.axes[0], text.get_window_extent()

    far = np.array([[0.0, 0.0], [0.0, 1e-3]])
    axes, box = drawn(far)
    x, y = (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0
    across = np.linspace([x - 40.0, y - 9.0], [x + 40.0, y + 9.0], 200)
    curve = axes.transData.inverted().transform(across)
    axes, box = drawn(curve)
    on_paper = axes.transData.transform(curve)
    assert not ((box.min + 1.0 < on_paper) & (on_paper < box.max - 1.0)).all(axis=1).any()
