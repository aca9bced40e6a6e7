"""kinfmu recover: what a killed run left, as a whole file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kinfmu.log import read, write_mcap
from tests.cli.conftest import Command
from tests.log.runs import fourbar


@pytest.fixture
def cut(tmp_path: Path) -> Path:
    """A record of 20000 samples without its last third."""
    path = tmp_path / "run.mcap"
    write_mcap(fourbar(np.arange(0.0, 200.0, 0.01)), path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    return path


def test_a_cut_record_is_completed_in_its_folder(cut: Path, command: Command, tmp_path: Path) -> None:
    left = cut.read_bytes()
    result = command("recover", "run.mcap")
    assert result.exit_code == 0
    first, last = result.stdout.splitlines()
    found = read(tmp_path / "run-recovered.mcap")
    assert len(found) > 8000
    assert first.startswith(f"at {found.t[-1]:g} s: the record ends here: the record at byte ")
    assert last.startswith(f"{len(found)} samples: ")
    assert last.endswith("; written to run-recovered.mcap")
    assert cut.read_bytes() == left


def test_a_whole_record_is_recovered_as_it_is(command: Command, tmp_path: Path) -> None:
    write_mcap(fourbar(np.arange(181.0)), tmp_path / "run.mcap")
    result = command("recover", "run.mcap", "-o", "same.mcap")
    assert result.stdout.startswith("181 samples: ")
    assert (tmp_path / "same.mcap").read_bytes() == (tmp_path / "run.mcap").read_bytes()


def test_other_commands_name_recover(cut: Path, fails: Callable[..., str]) -> None:
    for arguments in (("export", cut, "-o", "run.csv"), ("review", cut, "--save", "run.rrd")):
        assert fails(*arguments).endswith(f"; kinfmu recover {cut} keeps what is left")


def test_what_cannot_be_recovered_is_reported(
    cut: Path, refuses: Callable[..., str], fails: Callable[..., str], tmp_path: Path
) -> None:
    assert "none.mcap: there is no such file" in refuses("recover", "none.mcap")
    assert "run.csv: its name must end in .mcap" in refuses("recover", cut, "-o", "run.csv")
    (tmp_path / "text.mcap").write_text("no record")
    assert fails("recover", "text.mcap") == "text.mcap: nothing can be recovered: it does not begin as an MCAP file"
