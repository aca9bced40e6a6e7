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

run = fourbar(np.arange(0.0, 180.0, 0.02))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
_, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
for path, limit in zip(sys.argv[1::2], map(int, sys.argv[2::2]), strict=True):
    write = {"mcap": write_mcap, "rrd": write_rrd}.get(path.rpartition(".")[2], write_table)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        write(run, path)
    except LogError as error:
        print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on the size of a file simulates a full disk")
def test_a_file_on_a_full_disk_is_reported_in_one_line(tmp_path: Path) -> None:
    limits = {f"run.{suffix}": 200_000 for suffix in ("mcap", "rrd", "csv", "parquet", "npz")} | {"small.rrd": 1}
    for name in limits:
        (tmp_path / name).write_bytes(b"old")
    process = subprocess.run(
        [
            sys.executable,
            "-c",
            PROGRAM,
            *(word for name in limits for word in (str(tmp_path / name), str(limits[name]))),
        ],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    lines = process.stdout.splitlines()
    assert len(lines) == len(limits)
    for name, line in zip(limits, lines, strict=True):
        assert line.startswith(f"{tmp_path / name}: ")
        assert "written" in line
        assert (tmp_path / name).read_bytes() == b"old"
    assert {path.name for path in tmp_path.iterdir()} == set(limits)
