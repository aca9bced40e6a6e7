"""On a full disk: an error in one line, the old file stays, no other file is left."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import resource, signal, sys
import numpy as np
from kinfmu.errors import LogError
from kinfmu.log import write_mcap, write_rrd, write_table
from tests.log.runs import fourbar

run, path = fourbar(np.arange(0.0, 180.0, 0.02)), sys.argv[1]
write = {"mcap": write_mcap, "rrd": write_rrd}.get(path.rpartition(".")[2], write_table)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    write(run, path)
except LogError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on the size of a file simulates a full disk")
@pytest.mark.parametrize(
    ("suffix", "limit"), [*((suffix, 200_000) for suffix in ("mcap", "rrd", "csv", "parquet", "npz")), ("rrd", 1)]
)
def test_a_file_on_a_full_disk_is_reported_in_one_line(suffix: str, limit: int, tmp_path: Path) -> None:
    path = tmp_path / f"run.{suffix}"
    path.write_bytes(b"old")
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path), str(limit)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert len(process.stdout.splitlines()) == 1
    assert process.stdout.startswith(f"{path}: ")
    assert "written" in process.stdout
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
