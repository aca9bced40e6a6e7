"""Memory of a process that steps FMUs of the Python flavour: nothing is freed twice when it ends."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import kinfmu

STEPS = "import sys, kinfmu; [kinfmu.simulate(sys.argv[1], stop=0.1, step=0.05) for _ in range(2)]; print('stepped')"
LIBRARY = ("crank_rocker.so", "libpythonfmu-export")  # frames of an error in it


@pytest.mark.long
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_pythonfmus_library_frees_nothing_twice(tmp_path: Path) -> None:
    """Else some processes abort at their end, after all files are written."""
    fmu = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path / "crank_rocker.fmu", flavour="python", page=False)
    command = ["valgrind", f"--log-file={tmp_path / 'log'}", sys.executable, "-c", STEPS, str(fmu)]
    environment = {**os.environ, "PYTHONMALLOC": "malloc"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["stepped"]
    errors = (tmp_path / "log").read_text("utf-8").split("Invalid ")[1:]
    heads = [error.split("Address")[0] for error in errors]  # without where the memory came from
    assert [head for head in heads if any(name in head for name in LIBRARY)] == []
