"""Records that are cut, damaged, hostile or on a full disk: read as far as they go, refused with a reason."""

from __future__ import annotations

import dataclasses
import json
import re
import struct
import subprocess
import sys
import time
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard

from kinfmu.draw import animate
from kinfmu.errors import FigureError, LogError
from kinfmu.log import mcap_reader, read, record, recover, topics, write_mcap, writing
from kinfmu.log.cdr import Template
from kinfmu.log.mcap_writer import MESSAGE, ZSTD, Opcode
from kinfmu.log.viewer.series import groups
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


# ------------------------------------------------------------------------------------------------------ hostile records


NAMES = 600_000  # more than a record may hold


def line_of(path: Path) -> str:
    """Return the one line that reading and recovering report, without the name of the file."""
    with pytest.raises(LogError) as caught:
        read(path)
    (line,) = str(caught.value).splitlines()
    try:
        recover(path, path.with_name("again.mcap"))
    except LogError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017  # the file may have a beginning that is whole
    assert line.startswith(f"{path}: ")
    assert len(line) < 1000
    return line.removeprefix(f"{path}: ").removesuffix(f"; kinfmu recover {path} keeps what is left")


def with_texts(run: Run, path: Path, begin: dict[str, str], end: dict[str, str] | None = None) -> Path:
    """Write the record of a run with other texts and correct checksums."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writing, "description", lambda run: record.description(run) | begin)
        patch.setattr(writing, "ending", lambda run: record.ending(run) | (end or {}))
        write_mcap(run.part(slice(0, 3)), path, channels=["-drawn"])
    return path


DEEP = "[" * 100_000
ODD: list[Any] = [None, True, -1, 1.5, 10**400, "a", [], {}, [1], {"a": 1}, {"a.x": []}]
ODD += [["\ud800"], ["a\nb"], [["a.x"]]]
KEYS = ("columns", "units", "absent", "outputs", "coordinate_count", "fixed", "input_names", "watch_names")
KEYS += ("length_unit", "format", "computed")
FITTING = {
    "absent": ([],),
    "computed": ([],),
    "units": ({},),
    "watch_names": (),
    "fixed": ({},),
    "coordinate_count": (),
}  # by key


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.few(2)
def test_odd_texts_at_the_beginning_are_one_line(run: Run, tmp_path: Path, key: str) -> None:
    for value in ODD:
        if value in FITTING.get(key, ()):
            continue
        line = line_of(with_texts(run, tmp_path / "a.mcap", {key: json.dumps(value)}))
        assert key.removesuffix("s") in line or "columns of the record" in line
    for text in ("", "{", "nul", DEEP, "[" + "1," * 10, "9" * 5000, '"\ud800"'.encode("utf-8", "replace").decode()):
        assert key.removesuffix("s") in line_of(with_texts(run, tmp_path / "a.mcap", {key: text}))


@pytest.mark.parametrize("key", ["samples", "events"])
def test_odd_texts_at_the_end_are_one_line(run: Run, tmp_path: Path, key: str) -> None:
    events: list[Any] = [["a"], [[0.0, "info"]], [[0.0, "shout", "a"]], [["0", "info", "a"]], [[0.0, "info", "\ud800"]]]
    values = [value for value in ODD if not (key == "events" and value == [])] + (events if key == "events" else [])
    for text in (*map(json.dumps, values), "", "{", DEEP):
        assert key in line_of(with_texts(run, tmp_path / "a.mcap", {}, {key: text}))


@pytest.mark.parametrize(
    ("begin", "words"),
    [
        ({"outputs": '["crank.psi"]'}, "outputs of the record = ['crank.psi'] must be coordinates"),
        ({"outputs": '["a b.x"]'}, "must be coordinates"),
        ({"input_names": '["a_angle", "a_speed"]'}, "must be inputs, three for each driver"),
        ({"input_names": '["a_angle", "a_acceleration", "a_speed"]'}, "must be inputs, three for each driver"),
        ({"length_unit": '"parsec"'}, "length_unit of the record = 'parsec' must be one of m, mm"),
        ({"coordinate_count": "8"}, "coordinate_count of the record = 8 is more than its outputs"),
        ({"watch_names": '["AB", "CD"]'}, "columns of the record do not match its outputs, inputs, forces and watches"),
        ({"absent": '["coupler.x"]'}, "columns of the record do not match its outputs, inputs, forces and watches"),
        ({"computed": '["solver.status"]'}, "must be names among solver.margin, solver.error_q"),
        ({"columns": '["time", "time"]'}, "columns of the record hold a name twice"),
        ({"format": "9\n9"}, r"format '9\n9' of the record; this version of kinfmu reads '2'"),
    ],
)
def test_texts_that_disagree_are_one_line(run: Run, tmp_path: Path, begin: dict[str, str], words: str) -> None:
    assert words in line_of(with_texts(run, tmp_path / "a.mcap", begin))


@pytest.mark.parametrize("key", ["outputs", "columns", "absent", "watch_names"])
@pytest.mark.few(2)
def test_a_million_names_are_refused_at_once(run: Run, tmp_path: Path, key: str) -> None:
    names = json.dumps([f"a{k}.x" for k in range(NAMES)])
    path = with_texts(run, tmp_path / "a.mcap", {key: names})
    began = time.process_time()
    message = f"{key} of the record: {NAMES} entries; {record.MOST_COLUMNS} at most"
    assert line_of(path) == message
    assert time.process_time() - began < 5.0


def test_an_invalid_status_or_time_is_one_line(run: Run, tmp_path: Path) -> None:
    odd = dataclasses.replace(run, status=np.where(np.arange(len(run)) == 1, 17, run.status))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writing, "sentence", lambda _: "")
        patch.setattr(writing, "status_events", lambda _: [])
        write_mcap(odd, tmp_path / "a.mcap")
    assert line_of(tmp_path / "a.mcap") == "sample 1 has the status 17; known: 0 to 5"


def test_the_largest_numbers_are_drawn_or_refused(run: Run, tmp_path: Path) -> None:
    values = run.values.copy()
    values[7, 1], values[8, 1] = 1.7e308, -1.7e308
    values[::9, 2], values[::7, 2] = 1e308, -1e308
    large = dataclasses.replace(run, values=values)
    with pytest.raises(FigureError, match="poses of 'coupler' that are not numbers or too large to draw"):
        animate(large, tmp_path / "a.gif")
    assert groups(large)["position", "length"].shown is None
    values[7:9, 1:3] = np.nan
    with pytest.raises(FigureError, match="poses of 'coupler' that are not numbers or too large to draw"):
        animate(dataclasses.replace(run, values=values), tmp_path / "a.gif")


# ------------------------------------------------------------------------------------------------ sizes that lie


def chunk(raw: bytes, size: int | None = None, compression: str = ZSTD, packed: bytes | None = None) -> bytes:
    """The record of a chunk of these messages; size: its stated unpacked size."""
    if packed is None:
        packed = zstandard.ZstdCompressor(level=1).compress(raw)
    name = compression.encode()
    body = struct.pack("<QQQI", 0, 0, len(raw) if size is None else size, zlib.crc32(raw) if raw else 0)
    body += struct.pack("<I", len(name)) + name + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", Opcode.CHUNK, len(body)) + body


def behind_the_first(run: Run, path: Path, *chunks: bytes) -> Path:
    """The record of a run with more chunks before the end of its data."""
    write_mcap(run, path)
    whole = path.read_bytes()
    at = whole.rindex(struct.pack("<BQ", Opcode.DATA_END, 4))
    path.write_bytes(whole[:at] + b"".join(chunks) + whole[at:])
    return path


def test_a_chunk_that_claims_to_unpack_to_a_terabyte_is_refused(run: Run, tmp_path: Path) -> None:
    path = behind_the_first(run, tmp_path / "a.mcap", chunk(b"", 2**40, packed=b""))
    tracemalloc.start()
    try:
        assert f"its unpacked size is {2**40} bytes; the largest valid size is {mcap_reader.ALWAYS}" in line_of(path)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_chunks_that_unpack_to_gigabytes_are_refused_together(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcap_reader, "MOST_UNPACKED", 2**22)
    monkeypatch.setattr(mcap_reader, "LARGEST_RATIO", 1)
    empty = struct.pack("<BQ", Opcode.DATA_END, 2**20 - 9) + bytes(2**20 - 9)
    path = behind_the_first(run, tmp_path / "a.mcap", *[chunk(empty)] * 10)
    assert "its unpacked size is 1048576 bytes; the largest" in line_of(path)


def test_a_chunk_may_unpack_to_little_more_than_its_index_counts(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "a.mcap")
    opened = mcap_reader.McapReader(tmp_path / "a.mcap")
    channel = opened.id_of("/sample")
    assert channel is not None
    first = next(one for one in opened._chunks if channel in one.messages)
    length = next(opened.blocks(channel)).payloads.shape[1]
    true = first.messages[channel] * (MESSAGE.itemsize + length)
    assert true <= first.most(channel, length) <= max(2 * true, mcap_reader.ALWAYS)


RECORDS = {
    "of no length": bytes(9) * 10,
    "a record beyond the end": struct.pack("<BQ", Opcode.MESSAGE, 2**60) + bytes(100),
    "a message that is too short": struct.pack("<BQ", Opcode.MESSAGE, 3) + bytes(3) + bytes(9),
    "half a head": bytes(9) + b"\x05\x01",
}


@pytest.mark.parametrize("case", RECORDS)
def test_records_of_odd_lengths_in_a_chunk_are_one_line_or_nothing(run: Run, tmp_path: Path, case: str) -> None:
    path = behind_the_first(run, tmp_path / "a.mcap", chunk(RECORDS[case]))
    if case in ("of no length", "half a head"):
        assert len(read(path)) == len(run)
    else:
        assert "is damaged: a record goes beyond its end" in line_of(path)


def test_more_records_than_the_packed_bytes_can_hold_are_refused(run: Run, tmp_path: Path) -> None:
    path = behind_the_first(run, tmp_path / "a.mcap", chunk(bytes(9) * 100_000))
    assert "is damaged: too many records" in line_of(path)


def test_a_chunk_of_lz4_unpacks_to_no_more_than_it_states(run: Run, tmp_path: Path) -> None:
    lz4 = pytest.importorskip("lz4.frame")
    raw = bytes(2**24)
    path = behind_the_first(run, tmp_path / "a.mcap", chunk(b"", 100, "lz4", lz4.compress(raw)))
    tracemalloc.start()
    try:
        assert "wrong checksum" in line_of(path)
        assert tracemalloc.get_traced_memory()[1] < 8e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("is_cut", [False, True])
def test_a_long_run_in_which_nothing_moves_is_read(run: Run, tmp_path: Path, is_cut: bool) -> None:
    """Its ratio of compression is the largest of valid records."""
    n = 30_000
    still = dataclasses.replace(run.part(np.zeros(n, int)), t=np.arange(n) * 1.0)
    path = tmp_path / "still.mcap"
    write_mcap(still, path, channels=["-drawn"])
    if is_cut:
        whole = path.read_bytes()
        index = struct.pack("<BQH", Opcode.MESSAGE_INDEX, 6 + 16 * writing.ROWS, 0)
        path.write_bytes(whole[: whole.rindex(index, 0, len(whole) // 2)])  # a chunk without its index
        again = recover(path, tmp_path / "again.mcap")
        assert 0 < len(again) < n
    else:
        again = read(path)
        assert len(again) == n
    assert np.array_equal(again.values, still.values[: len(again)])


# ------------------------------------------------------------------------------------------------------------ full disk


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
