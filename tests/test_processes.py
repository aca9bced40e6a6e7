"""Processes and temporary folders that are left as they were found."""

from __future__ import annotations

import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NoReturn

import pytest

from kinfmu.files import temporary_folder
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


# ----------------------------------------------------------------------------------------------------- temporary folder


def filled(folder: Path) -> Path:
    (folder / "inner").mkdir()
    (folder / "inner" / "file").write_text("text")
    return folder


def test_it_is_there_in_the_block_and_gone_after_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with temporary_folder() as folder:
        assert filled(folder).parent == tmp_path
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileExistsError), temporary_folder() as folder:
        filled(filled(folder))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("when", ["before the first file", "after it"])
def test_a_signal_while_it_is_removed_leaves_nothing(
    when: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    real, calls = shutil.rmtree, []

    def interrupted(folder: Path, *, ignore_errors: bool) -> None:
        calls.append(folder)
        if len(calls) > 1 or when == "after it":
            real(folder / "inner" if len(calls) == 1 else folder, ignore_errors=ignore_errors)
        if len(calls) == 1:
            signal.raise_signal(signal.SIGTERM)

    def end(number: int, _frame: object) -> NoReturn:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, end)
    try:
        monkeypatch.setattr(shutil, "rmtree", interrupted)
        with pytest.raises(SystemExit), temporary_folder() as folder:
            filled(folder)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert len(calls) == 2
    assert list(tmp_path.iterdir()) == []
