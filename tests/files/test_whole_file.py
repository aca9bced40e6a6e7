"""Files are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from kinfmu import files as whole_file
from kinfmu.files import replacement, write_whole


def test_a_failure_leaves_the_older_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    write_whole(path, b"older", is_durable=True)

    def fail() -> None:
        with replacement(path) as temporary:
            temporary.write_bytes(b"half")
            assert path.read_bytes() == b"older"
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert path.read_bytes() == b"older"
    assert [one.name for one in tmp_path.iterdir()] == ["file.txt"]


def test_a_symbolic_link_is_kept(tmp_path: Path) -> None:
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    target.write_text("older")
    link.symlink_to(target)
    write_whole(link, b"newer")
    assert link.is_symlink()
    assert target.read_bytes() == b"newer"


def test_a_device_is_written_to_and_not_replaced() -> None:
    end, start = os.pipe()
    try:
        write_whole(f"/dev/fd/{start}", b"text")
        assert os.read(end, 10) == b"text"
    finally:
        os.close(end)
        os.close(start)


@pytest.mark.skipif(whole_file.fcntl is None, reason="Windows has no such locks")
def test_a_folder_that_another_program_locks_does_not_stop_the_writing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(whole_file, "PATIENCE", 0.05)
    folder = os.open(tmp_path, os.O_RDONLY)
    try:
        whole_file.fcntl.flock(folder, whole_file.fcntl.LOCK_EX)
        write_whole(tmp_path / "file.txt", b"text")
    finally:
        os.close(folder)
    assert (tmp_path / "file.txt").read_bytes() == b"text"


def test_the_temporary_name_of_a_long_name_is_not_longer(tmp_path: Path) -> None:
    path = tmp_path / f"{'n' * 250}.txt"
    write_whole(path, b"text")
    assert path.read_bytes() == b"text"
