"""SIGTERM and SIGHUP end a command in order: records are whole, and no half-written file stays behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kinfmu.log import read

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")

SIMULATE = ["simulate", "fourbar", "--step", "0.002", "--stop", "3600", "--mcap", "run.mcap"]
SOLVE = ["solve", "fourbar", "--engine", "python", "--times", "0:3600:0.001", "-o", "run.csv"]


def ended(arguments: list[str], number: int, folder: Path, *, until: str) -> subprocess.CompletedProcess[str]:
    """Run a command and send it a signal once `until`, a pattern of files in the folder, is there."""
    temporary = folder / "temporary"
    temporary.mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    command = [sys.executable, "-m", "kinfmu", *arguments]
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        start = time.monotonic()
        while not list(folder.glob(until)) and time.monotonic() < start + 60.0:
            time.sleep(0.01)
        process.send_signal(number)
        stdout, stderr = process.communicate(timeout=60.0)
    assert list(temporary.iterdir()) == []
    temporary.rmdir()
    return subprocess.CompletedProcess(command, process.returncode, stdout, stderr)


@pytest.mark.parametrize(
    "number",
    [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.long)] if sys.platform != "win32" else [],
)
def test_a_simulation_leaves_a_whole_record(number: int, tmp_path: Path) -> None:
    result = ended(SIMULATE, number, tmp_path, until="run.mcap")
    name = signal.Signals(number).name
    assert (result.returncode, result.stderr) == (128 + number, f"kinfmu: ended by {name}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]
    run = read(tmp_path / "run.mcap")
    assert 0 < len(run) < 1_800_000
    assert run.events[-1].text == f"at t = {run.t[-1] + 0.002:g} s: interrupted; the run ends here"


def test_a_command_that_is_ended_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("older")
    result = ended(SOLVE, signal.SIGTERM, tmp_path, until="temporary")
    assert result.returncode in (128 + signal.SIGTERM, -signal.SIGTERM)  # before the command line began
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    assert (tmp_path / "run.csv").read_text() == "older"
