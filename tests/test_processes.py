"""Processes that work for this one: they end with it, and do not run its script once more."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from kinfmu.processes import WorkerLostError, processes, without_main

SCRIPT = """
from math import factorial
from kinfmu.processes import processes, without_main

print("begin")
with processes(2) as pool, without_main():
    print(list(pool.map(factorial, range(5))))
"""


def test_a_script_runs_once_whatever_its_processes_do(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["begin", str([math.factorial(k) for k in range(5)])]


def test_a_process_that_is_lost_is_reported() -> None:
    with (
        pytest.raises(WorkerLostError, match="a worker process ended unexpectedly"),
        processes(1) as pool,
        without_main(),
    ):
        pool.submit(os._exit, 1).result()
