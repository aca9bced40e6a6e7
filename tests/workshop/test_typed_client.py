"""Types as a client of the installed package sees them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
CLIENT = """
import kinfmu

mechanism = kinfmu.Mechanism("pair", bodies=(kinfmu.Body("crank"), kinfmu.Body("ground")))
report = kinfmu.check(kinfmu.load("fourbar"))
run = kinfmu.solve(kinfmu.load("fourbar"), [0.0, 1.0])
kinfmu.log.write_mcap(run, "run.mcap")
again = kinfmu.log.read("run.mcap")
reveal_type(mechanism)
reveal_type(report)
reveal_type(run)
reveal_type(again["coupler.x"])
reveal_type(kinfmu.build(mechanism, "pair.fmu"))
kinfmu.load(1)
"""
REVEALED = (
    "kinfmu.mechanism.mechanism.Mechanism",
    "kinfmu.analysis.report.Report",
    "kinfmu.run.run.Run",
    "numpy.ndarray[",
    "pathlib.Path",
)


def test_mypy_finds_the_types_of_the_public_names(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "client.py").write_text(CLIENT.lstrip(), encoding="utf-8")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--strict",
            "--cache-dir",
            str(CHECKOUT / ".mypy_cache" / "client"),
            "client.py",
        ],
        cwd=tmp_path,
        env={**os.environ, "MYPY_FORCE_COLOR": "0"},
        capture_output=True,
        text=True,
        check=False,
    )
    notes = [line for line in done.stdout.splitlines() if "Revealed type" in line]
    assert len(notes) == len(REVEALED), done.stdout
    for note, expected in zip(notes, REVEALED, strict=True):
        assert expected in note
    (error,) = (line for line in done.stdout.splitlines() if "error: " in line)
    assert 'Argument 1 to "load" has incompatible type "int"' in error
