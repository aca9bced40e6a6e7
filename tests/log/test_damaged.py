"""Messages about damaged records, one for each kind of damage."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kinfmu.errors import LogError
from kinfmu.log import read, record, topics, write_mcap
from kinfmu.log.cdr import Template
from kinfmu.run import Run


def complaint(path: Path) -> str:
    """Return the message of reading a file, without the file's name and the advice to recover what is left."""
    with pytest.raises(LogError) as caught:
        read(path)
    message = str(caught.value).removeprefix(f"{path}: ")
    return message.removesuffix(f"; kinfmu recover {path} keeps what is left")


@pytest.mark.parametrize(
    ("offset", "changed", "message"),
    [
        (-8, b"\x00", "wrong checksum"),
        (-16, b"\x01", "its sizes disagree"),
        (-4, b"\x04\x00\x00\x01", "a field goes beyond its end"),
        (0, b"zoom", "compression 'zoom' is not known; known: zstd, lz4"),
        (4, b"\xff\xff\xff\xff", "a field goes beyond its end"),
    ],
    ids=["checksum", "size", "length of a text", "compression", "length of the data"],
)
def test_a_damaged_chunk_is_reported_with_its_place(
    run: Run, tmp_path: Path, offset: int, changed: bytes, message: str
) -> None:
    path = tmp_path / "run.mcap"
    write_mcap(run, path)
    whole = bytearray(path.read_bytes())
    name = whole.index(b"zstd")  # size, checksum and length of the name come before it, the length of the data after it
    place = name + offset
    assert whole[place : place + len(changed)] != changed
    whole[place : place + len(changed)] = changed
    path.write_bytes(whole)
    assert complaint(path) == f"the chunk at byte {name - 32} is damaged: {message}"


def test_a_record_of_unknown_kind_is_reported_with_its_place(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_mcap(run, path)
    whole = bytearray(path.read_bytes())
    whole[8] = 0x7F
    path.write_bytes(whole)
    assert complaint(path) == "not a whole MCAP file: the record at byte 8 is damaged: 0x7f is not a kind of record"


@pytest.mark.parametrize(
    ("text", "other", "message"),
    [
        (b'"coupler.x"', b'"coupler.w"', "metadata or mechanism are damaged (wrong checksum)"),
        (b"outcome", b"outcomf", "metadata 'kinfmu.end', written at the end of a run, are missing or damaged"),
    ],
)
def test_damaged_texts_are_reported(run: Run, tmp_path: Path, text: bytes, other: bytes, message: str) -> None:
    path = tmp_path / "run.mcap"
    write_mcap(run, path)
    path.write_bytes(path.read_bytes().replace(text, other, 1))
    assert complaint(path) == message


def test_a_record_of_another_format_is_reported(run: Run, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(record, "FORMAT", "1")
        write_mcap(run, tmp_path / "run.mcap")
    assert complaint(tmp_path / "run.mcap") == "format '1' of the record; this version of kinfmu reads '2'"


def test_samples_whose_length_does_not_match_their_columns_are_reported(run: Run, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(topics, "sample_template", lambda columns: Template().stamp().words(columns + 1))
        write_mcap(run, tmp_path / "run.mcap")
    found = re.fullmatch(r"a sample has (\d+) bytes instead of (\d+)", complaint(tmp_path / "run.mcap"))
    assert found is not None
    assert int(found[1]) == int(found[2]) + 8
