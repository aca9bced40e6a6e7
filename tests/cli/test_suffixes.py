"""A suffix decides what a file is, in small letters and in capitals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kinfmu.files import suffix_of
from kinfmu.log import write_mcap
from tests.cli.conftest import Command
from tests.log.runs import fourbar

BEGINNINGS = {"SVG": b"<?xml", "PNG": b"\x89PNG", "NPZ": b"PK", "PARQUET": b"PAR1", "GIF": b"GIF89a", "CSV": b"time,"}


@pytest.fixture
def record(tmp_path: Path) -> Path:
    path = tmp_path / "RUN.MCAP"
    write_mcap(fourbar(np.arange(5.0)), path)
    return path


def test_the_suffix_of_a_name_is_in_small_letters() -> None:
    assert [suffix_of(name) for name in ("run.MCAP", Path("a.b/RUN.Mcap"), "run", ".hidden")] == [
        ".mcap",
        ".mcap",
        "",
        "",
    ]


@pytest.mark.parametrize("suffix", BEGINNINGS)
@pytest.mark.few(2)
def test_a_run_is_exported_by_a_suffix_in_capitals(suffix: str, record: Path, command: Command, tmp_path: Path) -> None:
    if suffix == "PARQUET":
        pytest.importorskip("pyarrow")
    assert command("export", record, "-o", f"E.{suffix}").exit_code == 0
    assert (tmp_path / f"E.{suffix}").read_bytes().startswith(BEGINNINGS[suffix])
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"E.{suffix}", "RUN.MCAP"]


def test_a_mechanism_file_is_checked_solved_built_and_simulated(
    fourbar_file: Callable[..., Path], command: Command, tmp_path: Path
) -> None:
    file = fourbar_file(name="MINE.TOML").name
    for call in (
        ("check", file, "--figure", "F.SVG"),
        ("solve", file, "-o", "T.NPZ", "--times", "0:2:1"),
        ("build", file, "-o", "MINE.FMU"),
        ("simulate", "MINE.FMU", "--stop", 2),
        ("simulate", file, "--stop", 2, "--mcap", "S.MCAP", "--rrd", "S.RRD"),
    ):
        assert command(*call).exit_code == 0, call
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    logs = {str(Path("logs") / name) for name in ("MINE.mcap", "MINE.rrd")}
    assert names == {"F.SVG", "MINE.FMU", "MINE.TOML", "S.MCAP", "S.RRD", "T.NPZ"} | logs
    with np.load(tmp_path / "T.NPZ") as table:
        assert table["time"].tolist() == [0.0, 1.0, 2.0]


def test_runs_are_reviewed(record: Path, command: Command, refuses: Callable[..., str]) -> None:
    assert command("review", record, "--save", "R.RRD").stdout == "written: R.RRD\n"
    assert command("review", record, record, "--save", "BOTH.RRD").stdout == "written: BOTH.RRD\n"
    message = refuses("review", "R.RRD", "--save", "again.rrd")
    assert message == "R.RRD: a recording cannot be saved as another; give the run's .mcap file"
    assert "did you mean 'RUN.MCAP'?" in refuses("review", "RUNS.MCAp")
