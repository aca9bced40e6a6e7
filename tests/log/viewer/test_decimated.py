"""Long runs: the samples that a recording leaves out."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from kinfmu.log import write_rrd
from kinfmu.log.viewer import timeline
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.log.viewer.timeline import decimated
from kinfmu.run import Run
from tests.log.runs import fourbar, with_gap
from tests.log.viewer.test_rerun_file import SCALARS, documents, rows


@pytest.fixture
def long_run() -> Run:
    """2001 samples with a gap of three and one sample that stands out."""
    run = fourbar(np.linspace(0.0, 180.0, 2001))
    peaked = np.where(np.arange(2001) == 777, 5.0, run.residual)
    return with_gap(dataclasses.replace(run, residual=peaked), 1234, 1236)


def test_a_short_run_is_left_as_it_is(run: Run) -> None:
    assert decimated(run, 181) is run
    assert decimated(run) is run


def test_peaks_are_kept(long_run: Run) -> None:
    less = decimated(long_run, 100)
    assert 100 <= len(less) < 150
    kept = np.searchsorted(long_run.t, less.t)
    assert {0, 777, 1233, 1234, 1236, 1237, 2000} <= set(kept.tolist())
    for column, whole in zip(less.columns(), long_run.columns(), strict=True):
        np.testing.assert_array_equal(column.values, whole.values[kept])
        assert np.nanmax(column.values) == np.nanmax(whole.values)
        assert np.nanmin(column.values) == np.nanmin(whole.values)


def test_a_recording_states_what_it_leaves_out_and_holds_all_events(
    long_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(timeline, "MOST_ROWS", 100)
    write_rrd(long_run, tmp_path / "run.rrd")
    angles = rows(tmp_path / "run.rrd", "/position/angle", SCALARS)
    assert 100 <= len(angles) < 150
    (text,) = documents(tmp_path / "run.rrd", "/card")
    assert f"{len(angles)} of 2001 samples are drawn" in text
    assert len(rows(tmp_path / "run.rrd", "/log", "TextLog:text")) == 5
    write_comparison(long_run, long_run, tmp_path / "both.rrd")
    (text,) = documents(tmp_path / "both.rrd", "/card")
    assert "A: " in text
    assert "B: " in text
