"""Ctrl-C: the message, exit status 1, and the files that remain."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from kinfmu import log


def press(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


@pytest.mark.parametrize("early", ["kinfmu.fmu.build", "kinfmu.fmu.simulate"])
def test_simulate_that_is_stopped_before_the_first_sample_says_that_nothing_was_kept(
    early: str, fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(early, press)
    assert fails("simulate", "fourbar") == "stopped before the first sample: nothing was kept"
    assert list(tmp_path.iterdir()) == []


def test_simulate_that_is_stopped_while_the_recording_is_written_says_where_the_run_is(
    fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kinfmu.log.write_rrd", press)
    message = fails("simulate", "fourbar", "--mcap", "run.mcap")
    assert message == "stopped before the recording was written; the run is in run.mcap"
    assert len(log.read(tmp_path / "run.mcap")) == 181


@pytest.mark.parametrize("early", ["kinfmu.run.solve.solve", "kinfmu.log.write_table"])
def test_solve_that_is_stopped_says_that_nothing_was_written(
    early: str, fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(early, press)
    message = fails("solve", "fourbar", "-o", "run.csv")
    assert message == "stopped before the run was complete: nothing was written"
    assert list(tmp_path.iterdir()) == []
