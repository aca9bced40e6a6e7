"""The axes of plots: the whole run, with space for the label of its last tick and for the legend, and labels of y."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.log.viewer.blueprint import ABREAST, EDGE, NUMBERS, WIDTH, Plot, _abreast, plot, with_two_labels
from kinfmu.log.viewer.series import efforts, groups, margin
from kinfmu.log.viewer.timeline import timeline_of
from tests.log.runs import fourbar
from tests.run.test_forces import loaded

pytest.importorskip("rerun")
WIDEST_LABEL = 50.0  # [points], such as +100 ms


@pytest.mark.parametrize("width", [WIDTH / 2, WIDTH / ABREAST])
def test_the_label_at_the_end_of_the_run_is_not_cut_off(width: float) -> None:
    run = fourbar(np.arange(181.0))
    group = margin(run)
    assert group is not None
    view = plot(group.title, [("", group)], timeline_of([run]), [run], width)
    (shown,) = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()
    start, end = (shown[key] / 1e9 for key in ("start", "end"))
    assert start == pytest.approx(-EDGE * 180.0)
    assert (end - 180.0) / (end - start) * (width - NUMBERS) > 0.5 * WIDEST_LABEL


@pytest.mark.parametrize("height", [45.0, 82.0, 110.0, 300.0])
def test_an_axis_has_two_labels_at_powers_of_ten(height: float) -> None:
    """Rerun labels the multiples of the least power of ten that are 20 points apart or more."""
    drawn = np.random.default_rng(4)
    for _ in range(500):
        low, high = np.sort(drawn.choice([0.0, 1.0], 2) * drawn.normal(size=2) * 10.0 ** drawn.uniform(-9, 9, 2))
        if not high > low:
            continue
        bottom, top = with_two_labels(low, high, height)
        assert bottom <= low
        assert high <= top
        assert top - bottom < 25.0 * (high - low)
        steps = [step for k in range(-20, 20) if (step := 10.0**k) / (top - bottom) * height >= 20.0]
        labels = np.arange(np.ceil(bottom / steps[0]), np.floor(top / steps[0]) + 0.5)
        assert len(labels) >= 2, (low, high, bottom, top)


def test_a_legend_hides_no_curve() -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.1, 21))
    plots = [Plot(group.title, [("", group)]) for group in groups(run).values()]
    rows = [*([one, one] for one in plots), *_abreast([Plot(group.title, [("", group)]) for group in efforts(run)])]
    for row in rows:
        for one in row:
            names = one.groups[0][1].names
            view = plot(*one, timeline_of([run]), [run], WIDTH / len(row))
            (shown,) = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()
            start, end = (shown[key] / 1e9 for key in ("start", "end"))
            free = (end - 0.1) / (end - start) * (WIDTH / len(row) - NUMBERS)
            if len(names) > 1:
                assert free > 7.0 * max(map(len, names)) + 30.0, names  # letters, and the mark with its margins
