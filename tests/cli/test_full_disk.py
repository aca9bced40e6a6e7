"""Commands on a full disk: one line, an older file stays as it was, nothing is left behind."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.gallery_members import mostly_long

PROGRAM = """
import resource, signal, sys
from kinfmu.cli import main

limit, *arguments = sys.argv[1:]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), int(limit)))
main(arguments)
"""
COMMANDS = {
    "schema": (["schema", "-o", "out.json"], "out.json"),
    "build": (["build", "fourbar", "--flavour", "python", "-o", "out.fmu"], "out.fmu"),
    "figure": (["check", "fourbar", "--figure", "out.svg"], "out.svg"),
    "new": (["new", "fourbar", "out.toml"], "out.toml"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="a limit on the size of files simulates a full disk")
@pytest.mark.parametrize("name", mostly_long(COMMANDS, few=("schema", "figure", "new")))
@pytest.mark.few(1)
def test_a_full_disk_is_reported_in_one_line_and_leaves_no_file(name: str, tmp_path: Path) -> None:
    arguments, out = COMMANDS[name]
    existed = name != "new"  # new never replaces a file
    if existed:
        (tmp_path / out).write_text("older")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, "400", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert done.returncode == 1
    *_, line = done.stderr.splitlines()  # before it, matplotlib may report that its cache cannot be written
    assert line == f"kinfmu: {out}: cannot be written (File too large)"
    assert [path.name for path in tmp_path.iterdir()] == ([out] if existed else [])
    if existed:
        assert (tmp_path / out).read_text() == "older"
