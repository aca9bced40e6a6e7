"""An installation without the extra `viewer`: records are written, and what needs the viewer is refused in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from kinfmu.log import read

BASE = (  # a process in which the packages of the extras cannot be imported
    "import sys; sys.modules.update(dict.fromkeys(('rerun', 'rerun_bindings', 'rerun_cli', 'PIL', 'matplotlib')))\n"
)
INSTALL = "needs the Rerun viewer: pip install 'kinfmu[viewer]'"


def outcomes(folder: Path, *commands: str) -> list[tuple[int, str, str]]:
    """Return exit status, output and errors of commands, which run one after another in one process."""
    code = f"""{BASE}
import json
from click.testing import CliRunner
from kinfmu.cli import main
results = [CliRunner().invoke(main, command.split(), prog_name="kinfmu") for command in sys.argv[1:]]
print(json.dumps([(one.exit_code, one.stdout, one.stderr) for one in results]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code, *commands], cwd=folder, capture_output=True, text=True, check=True
    )
    return [tuple(outcome) for outcome in json.loads(done.stdout)]


def test_simulate_writes_the_record_alone_and_reports_it(tmp_path: Path) -> None:
    ((status, out, err),) = outcomes(tmp_path, "simulate fourbar --stop 3")
    assert (status, err) == (0, "")
    first, second = out.splitlines()
    assert first.endswith("; written to logs/fourbar.mcap")
    assert second == f"no recording, which {INSTALL}"
    assert [path.name for path in (tmp_path / "logs").iterdir()] == ["fourbar.mcap"]
    assert len(read(tmp_path / "logs" / "fourbar.mcap")) == 4
    (tmp_path / "logs" / "fourbar.rrd").write_bytes(b"older")
    tables = ("run.csv", "run.parquet")
    again, without, *exports = outcomes(
        tmp_path,
        "simulate fourbar --stop 2",
        "simulate fourbar --stop 2 --channels none",
        *(f"export logs/fourbar.mcap -o {name}" for name in tables),
    )
    assert (again[0], again[2]) == (0, "")
    assert again[1].splitlines()[1] == f"no recording, which {INSTALL}; logs/fourbar.rrd is of an older run"
    assert (without[0], without[2], len(without[1].splitlines())) == (0, "", 1)
    assert exports == [(0, f"written: {name}\n", "") for name in tables]


def test_what_needs_the_viewer_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    refused = {
        "simulate fourbar --rrd a.rrd": "a.rrd: a recording",
        "simulate fourbar --live": "--live",
        "review run.mcap": "run.mcap: a review",
        "review run.mcap --screenshot a.png": "run.mcap: a review",
    }
    (tmp_path / "run.mcap").touch()
    assert outcomes(tmp_path, *refused) == [(1, "", f"kinfmu: {what} {INSTALL}\n") for what in refused.values()]
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_so_are_the_functions_of_the_log(tmp_path: Path) -> None:
    code = f"""{BASE}
import kinfmu
from kinfmu.errors import MissingPackageError
from kinfmu.log.viewer.comparison import write_comparison
run = kinfmu.solve(kinfmu.load("fourbar"), [0.0, 1.0])
for call in (
    lambda: kinfmu.log.write_rrd(run, "a.rrd"), lambda: write_comparison(run, run, "a.rrd"), kinfmu.log.LiveView
):
    try:
        call()
    except MissingPackageError as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    recording = f"a.rrd: a recording {INSTALL}"
    assert done.stdout.splitlines() == [recording, recording, f"the live view {INSTALL}"]
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_so_is_the_recording_of_the_demo(tmp_path: Path) -> None:
    code = f"{BASE}from kinfmu.cli import demo; sys.exit(demo.main())"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"wrote logs/fourbar.mcap; no recording: logs/fourbar.rrd: a recording {INSTALL}" in done.stdout
    assert "no picture: logs/fourbar.gif: " in done.stdout
