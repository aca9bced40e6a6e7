"""Temporary folders are removed, whenever a signal comes."""

from __future__ import annotations

import shutil
import signal
import tempfile
from pathlib import Path
from typing import NoReturn

import pytest

from kinfmu.files import temporary_folder


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
