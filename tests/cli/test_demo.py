from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.cli import demo
from tests.oracle import largest_error, reference_fourbar


@pytest.mark.long
def test_the_demo_does_the_main_job(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert demo.main() == 0
    message = capsys.readouterr().out
    for finding in (
        "mobility 1 (Gruebler's count 0",
        "note  AB is redundant: it follows from O, P, C, Q",
        "Branches cross at crank = 0 deg, 180 deg",
        "all 25 numbers agree",
        "181 samples",
        "kinfmu review logs/fourbar.mcap",
    ):
        assert finding in message
    kept = kinfmu.log.read(tmp_path / "logs" / "fourbar.mcap")
    assert (kept.t[0], kept.t[-1], len(kept)) == (0.0, 180.0, 181)
    assert (tmp_path / "logs" / "fourbar.rrd").is_file()
    shown = tmp_path / "logs" / "fourbar.gif"
    assert shown.resolve().as_uri() in message
    assert shown.read_bytes().startswith(b"GIF89a")


def test_the_demos_closed_form_is_that_of_the_oracle() -> None:
    t = np.array([0.0, 17.0, 90.0, 180.0])
    speed = np.pi / 180.0
    exact = reference_fourbar(list(speed * t), speed)
    for order, (ours, theirs) in enumerate(zip(demo.parallelogram(speed * t), exact, strict=True)):
        assert largest_error(ours * speed**order, theirs) < 1e-15


def test_a_run_that_differs_fails_the_demo() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), np.arange(181.0), parameters={"crank.speed": 0.017})
    assert demo.compare_with_report(run)[1] is False
    assert demo.compare_with_closed_form(run)[1] is False
