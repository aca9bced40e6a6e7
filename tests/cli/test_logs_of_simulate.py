"""kinfmu simulate --channels, --rate: what is kept, none at all, and the names of the logs."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from kinfmu import log
from tests.cli.conftest import Command


def test_channels_and_rate_choose_what_is_kept(command: Command, tmp_path: Path) -> None:
    result = command("simulate", "fourbar", "--channels", "q, residual", "--rate", "0.1")
    assert result.exit_code == 0
    run = log.read(tmp_path / "logs" / "fourbar.mcap")
    assert run.t.tolist() == [10.0 * k for k in range(19)]
    assert [column.name for column in run.columns()] == ["time", *run.names, "solver.status", "solver.residual"]
    assert result.stdout.startswith("19 samples: ")


def test_a_minus_leaves_out(command: Command, tmp_path: Path) -> None:
    assert command("simulate", "fourbar", "--stop", "2", "--channels", "-error,-residual").exit_code == 0
    run = log.read(tmp_path / "logs" / "fourbar.mcap")
    assert run.absent == {"solver.residual", *(f"solver.error_{order}" for order in ("q", "qd", "qdd"))}


def test_none_leaves_no_logs(command: Command, refuses: Callable[..., str], tmp_path: Path) -> None:
    result = command("simulate", "fourbar", "--channels", "none")
    assert result.exit_code == 0
    assert result.stdout.startswith("181 samples: ")
    assert "nan" not in result.stdout
    assert "written" not in result.stdout
    assert not list(tmp_path.iterdir())
    message = refuses("simulate", "fourbar", "--channels", "none", "--mcap", "run.mcap")
    assert message == "--channels none leaves nothing to write to run.mcap"


@pytest.mark.parametrize(
    ("model", "name"), [("fourbar_chain:2", "fourbar_chain_2"), ("mine.toml", "mine"), ("other.fmu", "other")]
)
@pytest.mark.few(1)
def test_logs_have_the_name_of_what_is_simulated(
    model: str, name: str, command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    fourbar_file(name="mine.toml")
    assert command("build", "fourbar", "-o", "other.fmu").exit_code == 0
    assert command("simulate", model, "--stop", "1").exit_code == 0
    assert sorted(path.name for path in (tmp_path / "logs").iterdir()) == [f"{name}.mcap", f"{name}.rrd"]


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="names of files are Unicode there")
@pytest.mark.parametrize("place", [b"caf\xe9.toml", b"M\xfcll/mine.toml"])  # Latin-1
def test_names_of_files_need_not_be_utf8(
    place: bytes, command: Command, fourbar_file: Callable[..., Path], tmp_path: Path
) -> None:
    file = tmp_path / os.fsdecode(place)
    file.parent.mkdir(exist_ok=True)
    fourbar_file(name="mine.toml").replace(file)
    logs = [file.with_suffix(suffix) for suffix in (".mcap", ".rrd")]
    assert command("simulate", str(file), "--stop", "1", "--mcap", str(logs[0]), "--rrd", str(logs[1])).exit_code == 0
    assert log.read(logs[0]).good.all()
    compared = file.with_name(os.fsdecode(b"\xe9.rrd"))
    assert command("review", str(logs[0]), str(logs[0]), "--save", str(compared)).exit_code == 0
    assert all(b"RRF" in path.read_bytes()[-64:] for path in (logs[1], compared))
