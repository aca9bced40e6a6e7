"""The axes of plots: the whole run, with space for the label of its last tick."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.log.viewer.blueprint import EDGE, NARROW, PLOT, plot
from kinfmu.log.viewer.series import margin
from kinfmu.log.viewer.timeline import timeline_of
from tests.log.runs import fourbar

pytest.importorskip("rerun")
WIDEST_LABEL = 50.0  # [points], such as +100 ms


@pytest.mark.parametrize("width", [PLOT, NARROW])
def test_the_label_at_the_end_of_the_run_is_not_cut_off(width: float) -> None:
    run = fourbar(np.arange(181.0))
    group = margin(run)
    assert group is not None
    view = plot(group.title, [("", group)], timeline_of([run]), [run], width)
    (shown,) = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()
    start, end = (shown[key] / 1e9 for key in ("start", "end"))
    assert start == pytest.approx(-EDGE * 180.0)
    assert (end - 180.0) / (end - start) * width > 0.5 * WIDEST_LABEL
