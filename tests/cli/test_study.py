"""kinfmu study: summary, figure, interruptions and wrong usage."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from tests.cli.test_command_line import on_a_terminal
from tests.design.study.linkage import write
from tests.log.sheets import read_xlsx

GRID = 'mechanism = "hoeken.toml"\nparameters.base = { from = 40, to = 300, count = 3 }\n'
LONG = 'mechanism = "hoeken.toml"\ndesigns = 5000\nparameters.base = { from = 40, to = 50 }\n'


def test_it_prints_a_summary_and_writes_table_and_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, GRID)
    monkeypatch.chdir(tmp_path)
    command = ["study", "study.toml", "--workers", "1", "--figure", "study.svg", "--measures", "swing"]
    command += ["--table", "study.xlsx", "--lengths", "m"]
    result = CliRunner().invoke(main, command)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "hoeken: 3 designs (on a grid) over base; one turn of crank at 30 rpm"
    assert lines[2].split() == ["measure", "unit", "nominal", "mean", "deviation", "min", "max", "failures"]
    assert lines[3].split()[-1] == "2"
    assert lines[-5].startswith("2 of 3 designs lack a measure, the first is design 1: ")
    assert lines[-3:] == ["results: study.parquet", "table: study.xlsx", "figure: study.svg"]
    table, results = read_xlsx(tmp_path / "study.xlsx"), kinfmu.StudyResult.read(tmp_path / "study.parquet")
    np.testing.assert_allclose(table["base [m]"], 1e-3 * results["base"], rtol=1e-15)
    np.testing.assert_allclose(table["swing [deg]"], np.degrees(results["swing"]), rtol=1e-15)
    assert "fastest" not in (tmp_path / "study.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["study.tml"], "its name must end in .toml"),
        (["stud.toml"], "there is no such file; did you mean 'study.toml'?"),
        (["study.toml", "-o", "a.npz"], "its name must end in one of .parquet, .csv"),
        (["study.toml", "--decimal", ","], "--lengths, --units, --separator and --decimal need --table"),
        (["study.toml", "--workers", "0"], "0 is not in the range x>=1"),
        (["study.toml", "--workers", "2", "--dask", "tcp://a:1"], "--workers is for this machine"),
    ],
)
def test_wrong_usage_is_reported(
    arguments: list[str], text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, GRID)
    (tmp_path / "study.tml").write_text("")
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["study", *arguments])
    assert result.exit_code == 2
    assert text in result.stderr


def test_a_mistake_in_the_file_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, GRID.replace("count", "cout"))
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["study", "study.toml"])
    assert result.exit_code == 1
    assert result.stderr.startswith("kinfmu: study.toml: [parameters.base] cout: unknown key; did you mean 'count'?")
    assert result.stderr.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
@pytest.mark.long
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 1), (signal.SIGTERM, 143)])
def test_an_interrupted_study_says_how_to_go_on(number: int, status: int, tmp_path: Path) -> None:
    write(tmp_path, LONG)
    command = [sys.executable, "-m", "kinfmu", "study", "study.toml", "--workers", "2", "--engine", "python"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        end = time.monotonic() + 120.0
        while not list(tmp_path.glob("study.parquet.parts/part-*")) and time.monotonic() < end:
            time.sleep(0.01)
        process.send_signal(number)
        stdout, stderr = process.communicate(timeout=120.0)
    assert (process.returncode, stdout) == (status, "")
    last = stderr.splitlines()[-1]
    assert "of 5000 designs are kept in study.parquet.parts: the same command goes on from there" in last
    assert len(stderr.splitlines()) == (1 if number == signal.SIGINT else 2)


@pytest.mark.long
def test_on_a_terminal_a_line_shows_how_much_is_done_and_the_time_left(tmp_path: Path) -> None:
    write(tmp_path, LONG.replace("5000", "800"))
    command = ("-m", "kinfmu", "study", "study.toml", "--workers", "1", "--engine", "python")
    text = on_a_terminal(command, tmp_path, {"COLUMNS": "120"}).decode()
    lines = re.findall(r"kinfmu study study\.toml +\[[#-]+\] +(\d+)%(?:  (\d\d):(\d\d):(\d\d))?", text)
    assert lines, text
    parts = [int(part) for part, *_ in lines]
    assert (parts[0], parts[-1]) == (0, 100)
    assert parts == sorted(parts)
    left = [
        60 * int(minutes) + int(seconds) for part, hours, minutes, seconds in lines if hours == "00" and part != "100"
    ]
    assert left, text  # of the lines in between
    assert max(left) <= 600
    assert left[-1] <= left[0] + 1
    assert "results: study.parquet" in text
