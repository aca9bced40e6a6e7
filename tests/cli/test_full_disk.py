"""Commands on a full disk: one line, an older file stays as it was, nothing is left behind."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import resource, signal, sys
from kinfmu.cli import main

room, *arguments = sys.argv[1:]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(room), int(room)))
main(arguments)
"""
COMMANDS = {
    "schema": (["schema", "-o", "out.json"], "out.json"),
    "build": (["build", "fourbar", "--flavour", "python", "-o", "out.fmu"], "out.fmu"),
    "figure": (["check", "fourbar", "--figure", "out.svg"], "out.svg"),
    "new": (["new", "fourbar", "out.toml"], "out.toml"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on the size of a file stands in for a full disk")
@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_that_finds_no_room_is_one_line_and_no_file(name: str, tmp_path: Path) -> None:
    arguments, out = COMMANDS[name]
    is_there = name != "new"  # which never replaces a file
    if is_there:
        (tmp_path / out).write_text("older")
    told = subprocess.run(
        [sys.executable, "-c", PROGRAM, "400", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert told.returncode == 1
    *_, line = told.stderr.splitlines()  # before it, matplotlib may tell that it finds no room for its cache
    assert line == f"kinfmu: {out}: cannot be written (File too large)"
    assert [path.name for path in tmp_path.iterdir()] == ([out] if is_there else [])
    if is_there:
        assert (tmp_path / out).read_text() == "older"
