"""The live view: pieces of a run go to the stream while it is computed, and nothing is sent twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import LogError
from kinfmu.log import LiveView
from kinfmu.log.viewer import live
from tests.log.viewer.test_rerun_file import documents, rows

rr = pytest.importorskip("rerun")


def test_pieces_of_a_run_are_in_the_stream_once_with_layout_and_card(tmp_path: Path) -> None:
    path = tmp_path / "live.rrd"
    stream = rr.RecordingStream("kinfmu_test", recording_id="live")
    stream.save(path)
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 2.0, 41))
    view, sent = LiveView(stream), []
    view.begin(run.part(slice(0, 0)))
    for start in (0, 10, 25):
        view.add(run.part(slice(start, {0: 10, 10: 25, 25: 41}[start])))
        sent.append(path.stat().st_size)
    assert 0 < sent[0] < sent[1] < sent[2]  # a viewer has it before the run ends
    view.end(run, "")
    stream.disconnect()
    assert path.stat().st_size > sent[2]
    times = list(np.rint(run.t * 1e9))
    assert [t for t, _ in rows(path, "/position/angle", "Scalars:scalars")] == times
    assert [t for t, _ in rows(path, "/linkage/bodies/crank", "Transform3D:translation")] == times
    assert documents(path, "/card")[0].startswith("#")


def test_a_viewer_that_is_closed_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "ANSWER_TIME", 0.2)
    stream = rr.RecordingStream("kinfmu_test", recording_id="closed")
    flushed: list[float] = []

    def lost(*, timeout_sec: float) -> None:
        flushed.append(timeout_sec)
        raise RuntimeError("no viewer")

    monkeypatch.setattr(stream, "flush", lost)
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 1.0, 5))
    view = LiveView(stream)
    view.begin(run.part(slice(0, 0)))
    view.add(run)
    view.add(run)
    view.end(run, "")
    assert flushed == [0.2]  # nothing is sent after that


def test_without_display_and_viewer_the_message_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "PORT", 1)  # nothing listens there
    monkeypatch.setattr(live.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(LogError, match=r"^there is no display to open the viewer on; .*--screenshot F\.png$"):
        LiveView()
