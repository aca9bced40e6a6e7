"""An MCAP file that grows with its run: what was added stays, and recover makes a complete file of it."""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import LogError
from kinfmu.log import McapLog, read, recover, write_mcap
from kinfmu.log.viewer.headless import executable
from kinfmu.run import Event, Run
from tests.log.runs import KINDS, fourbar, without_samples
from tests.log.test_mcap import assert_same, messages

ROOT = Path(__file__).parents[2]


def pieces(run: Run, size: int) -> Iterator[Run]:
    """The run in pieces, each with the events up to its last sample; what is left goes with the last."""
    left = list(run.events)
    for start in range(0, len(run), size):
        part = run.part(slice(start, start + size))
        is_last = start + size >= len(run)
        now = [event for event in left if is_last or event.t <= part.t[-1]]
        left = [event for event in left if event not in now]
        yield dataclasses.replace(part, events=tuple(now))


def grown(run: Run, path: Path, size: int, *, drawn: bool = True) -> None:
    """Write the run piece by piece."""
    sink = McapLog(path, drawn=drawn)
    sink.begin(without_samples(run))
    for piece in pieces(run, size):
        sink.add(piece)
    sink.end(run, "")


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("kind", ["plain", "with a gap", "nothing but gap", "before zero", "no mechanism"])
@pytest.mark.few(5)
def test_a_run_that_grew_reads_back_bit_for_bit(kind: str, size: int, tmp_path: Path) -> None:
    run = KINDS[kind]()
    grown(run, tmp_path / "run.mcap", size)
    assert_same(run, read(tmp_path / "run.mcap"))


def test_a_run_that_grew_has_the_same_topics_as_one_written_at_once(run_with_gap: Run, tmp_path: Path) -> None:
    grown(run_with_gap, tmp_path / "grown.mcap", 7)
    write_mcap(run_with_gap, tmp_path / "whole.mcap")
    for topic in ("/sample", "/joint_states", "/joint_accelerations", "/tf", "/robot_description", "/log"):
        assert messages(tmp_path / "grown.mcap", topic) == messages(tmp_path / "whole.mcap", topic), topic


def test_a_failure_whose_reason_comes_after_its_sample_has_one_row(run_with_gap: Run, tmp_path: Path) -> None:
    run = run_with_gap.part(slice(0, 101), events=run_with_gap.events)
    sink = McapLog(tmp_path / "run.mcap")
    sink.begin(without_samples(run))
    sink.add(dataclasses.replace(run, events=()))
    sink.add(run.part(slice(101, 101), events=run.events))
    sink.end(run, "")
    found = [payload for time, payload in messages(tmp_path / "run.mcap", "/log") if time == 100 * 10**9]
    assert len(found) == 1
    assert b"the limit is 1.75 rad" in found[0]


@pytest.mark.parametrize("rows", [101, 110])
def test_a_failure_without_a_reason_is_in_the_log_at_the_end(rows: int, run_with_gap: Run, tmp_path: Path) -> None:
    run = run_with_gap.part(slice(0, rows))
    sink = McapLog(tmp_path / "run.mcap")
    sink.begin(without_samples(run))
    sink.add(run.part(slice(0, 101)))
    sink.add(run.part(slice(101, rows)))
    sink.end(run, "")
    (found,) = [payload for time, payload in messages(tmp_path / "run.mcap", "/log") if time == 100 * 10**9]
    assert b"outside" in found


def test_rerun_verifies_a_file_that_grew(run_with_gap: Run, tmp_path: Path) -> None:
    grown(run_with_gap, tmp_path / "run.mcap", 7)
    process = subprocess.run(
        [executable(), "mcap", "check", "--full", str(tmp_path / "run.mcap")],
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [line.split() for line in process.stdout.splitlines() if "/" in line and "ID" not in line]
    assert {row[0] for row in rows[1:]} == {"ok"}


def test_what_was_added_is_in_the_file_at_once(run: Run, tmp_path: Path) -> None:
    sink = McapLog(tmp_path / "run.mcap")
    sink.begin(without_samples(run))
    for k, piece in enumerate(pieces(run, 20)):
        sink.add(piece)
        found = recover(tmp_path / "run.mcap", tmp_path / "found.mcap")
        np.testing.assert_array_equal(found.values, run.values[: 20 * k + len(piece)])
    sink.close()


def test_a_sink_that_is_used_again_writes_a_new_file(run: Run, tmp_path: Path) -> None:
    sink = McapLog(tmp_path / "run.mcap")
    for part in (run, run.part(slice(5, 50))):
        sink.begin(without_samples(part))
        for piece in pieces(part, 20):
            sink.add(piece)
        sink.end(part, "")
        assert_same(part, read(tmp_path / "run.mcap"))


def test_the_older_file_stays_until_the_first_samples(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"old")
    sink = McapLog(path)
    sink.begin(without_samples(run))
    assert path.read_bytes() == b"old"
    sink.add(run.part(slice(0, 1)))
    sink.close()
    assert path.read_bytes() != b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_path_that_cannot_be_written_is_reported_before_the_first_sample(run: Run, tmp_path: Path) -> None:
    (tmp_path / "null.mcap").symlink_to(os.devnull)
    (tmp_path / "none").touch()
    for name, why in (("none/run.mcap", "Not a directory"), ("null.mcap", "is a device or a pipe")):
        with pytest.raises(LogError, match=why):
            McapLog(tmp_path / name).begin(without_samples(run))
    with pytest.raises(LogError, match="is a device or a pipe, which a file would replace"):
        write_mcap(run, tmp_path / "null.mcap")


@pytest.mark.parametrize("share", np.linspace(0.0, 0.999, 12))
@pytest.mark.few(5)
def test_what_is_left_of_a_cut_file_is_the_beginning_of_the_run(
    share: float, run_with_gap: Run, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    run = dataclasses.replace(run_with_gap, events=(Event(1 / 3, "info", "a third"), *run_with_gap.events))
    grown(run, path, 10)
    whole = path.read_bytes()
    first = whole.index(b"zstd", whole.index(b"zstd") + 4)  # behind the first chunk of samples
    path.write_bytes(whole[: first + int(share * (len(whole) - first))])
    with pytest.raises(LogError, match=r"not a whole MCAP file: .*within|goes beyond|ends at"):
        read(path)
    found = recover(path, tmp_path / "found.mcap")
    assert len(found) >= 10
    assert_same(found, read(tmp_path / "found.mcap"))
    assert found.events[-1].text.startswith("the record ends here: ")
    assert found.mechanism_text == run.mechanism_text
    n = len(found)
    for name in ("t", "inputs", "values", "rates", "accelerations", "status", "iterations", "margin", "error", "watch"):
        assert getattr(found, name).tobytes() == getattr(run, name)[:n].tobytes()
    assert set(found.events[:-1]) <= {*run.events, Event(0.333333333, "info", "a third")}


def test_events_of_a_cut_file_are_at_the_times_of_their_samples(tmp_path: Path) -> None:
    run = fourbar(0.1 * np.arange(40.0) / 3)
    run = dataclasses.replace(run, events=(Event(float(run.t[7]), "warning", "seven"),))
    grown(run, tmp_path / "run.mcap", 10)
    whole = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(whole[: whole.index(b"kinfmu.end") - 20])
    assert recover(tmp_path / "run.mcap", tmp_path / "found.mcap").events[0] == run.events[0]


def test_a_damaged_chunk_ends_what_is_recovered(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    grown(run, path, 20, drawn=False)
    damaged = bytearray(path.read_bytes())
    places = [k for k in range(len(damaged)) if damaged[k : k + 4] == b"zstd"]
    damaged[places[len(places) // 3] + 40] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(LogError, match=r"the chunk at byte \d+ is damaged: .*; kinfmu recover .* keeps what is left"):
        read(path)
    found = recover(path, tmp_path / "found.mcap")
    assert 0 < len(found) < len(run)
    assert found.values.tobytes() == run.values[: len(found)].tobytes()


def test_a_file_without_a_run_cannot_be_recovered(run: Run, tmp_path: Path) -> None:
    grown(run, tmp_path / "run.mcap", 20)
    whole = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(whole[: whole.index(b"/sample")])
    with pytest.raises(LogError, match=r"run\.mcap: nothing can be recovered: the record at byte \d+ goes beyond"):
        recover(tmp_path / "run.mcap", tmp_path / "found.mcap")
    with pytest.raises(LogError, match=r"run\.mcap: not a whole MCAP file: .* byte \d+$"):  # recover is not advised
        read(tmp_path / "run.mcap")
    (tmp_path / "run.mcap").write_bytes(b"")
    with pytest.raises(LogError, match=r"run\.mcap: nothing can be recovered: it is empty$"):
        recover(tmp_path / "run.mcap", tmp_path / "found.mcap")
    (tmp_path / "text.mcap").write_text("t,x\n0,1\n")
    with pytest.raises(LogError, match=r"text\.mcap: nothing can be recovered: it does not begin as an MCAP file"):
        recover(tmp_path / "text.mcap", tmp_path / "found.mcap")
    assert not (tmp_path / "found.mcap").exists()


KILLED = """
import os, signal, sys
import kinfmu
from kinfmu.fmu.host import samples
from kinfmu.log import McapLog

samples.PIECE = 64 * 1024

class KilledLog(McapLog):
    "Kills its process as it gets its fourth piece."
    pieces = 0

    def add(self, run):
        self.pieces += 1
        if self.pieces == 4:
            print(run.t[0], flush=True)
            os.kill(os.getpid(), signal.SIGKILL)
        super().add(run)

kinfmu.simulate(sys.argv[1], step=0.01, sink=KilledLog(sys.argv[2]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_killed_simulation_leaves_all_pieces_but_the_last(fmu: Callable[[], Path], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    killed = subprocess.run(
        [sys.executable, "-c", KILLED, str(fmu()), str(path)], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    found = recover(path, tmp_path / "found.mcap")
    expected = kinfmu.simulate(fmu(), step=0.01, stop=float(found.t[-1]))
    assert len(found) > 100
    assert float(killed.stdout) == pytest.approx(found.t[-1] + 0.01)
    assert found.t.tobytes() == expected.t.tobytes()
    for name in ("values", "rates", "accelerations", "inputs", "residual", "margin", "error", "watch", "status"):
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
    assert_same(found, read(tmp_path / "found.mcap"))


FULL = """
import resource, signal, sys
import kinfmu
from kinfmu.errors import LogError
from kinfmu.log import McapLog

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
fmu, path = sys.argv[1:]

def limit(done, _):
    if done == 1:  # the FMU is unpacked
        resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, 2_000_000))

try:
    kinfmu.simulate(fmu, step=0.01, sink=McapLog(path), progress=limit)
except LogError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on the size of a file simulates a full disk")
def test_a_disk_that_fills_up_loses_nothing_that_was_written(fmu: Callable[[], Path], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    process = subprocess.run(
        [sys.executable, "-c", FULL, str(fmu()), str(path)], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert process.stdout.count("\n") == 1
    assert process.stdout.startswith(f"{path}: cannot be written (File too large); it holds the run up to t = ")
    assert process.stdout.rstrip().endswith(f"kinfmu recover {path}")
    until = float(process.stdout.partition("t = ")[2].split()[0])
    found = recover(path, tmp_path / "found.mcap")
    assert found.t[-1] == pytest.approx(until)
    assert len(found) > 100
    assert found.events[-1].text.startswith("the record ends here: it ends at byte ")


def test_a_run_that_fails_is_kept_with_the_reason(fmu: Callable[[], Path], tmp_path: Path) -> None:
    def fail(done: int, _: int) -> None:
        if done == 50:
            raise RuntimeError("the host gave up")

    with pytest.raises(RuntimeError):
        kinfmu.simulate(fmu(), sink=McapLog(tmp_path / "run.mcap"), progress=fail)
    found = read(tmp_path / "run.mcap")
    assert len(found) == 50
    assert found.events[-1] == Event(float(found.t[-1]), "error", "the host gave up")
    assert b"the host gave up" in messages(tmp_path / "run.mcap", "/log")[-1][1]


@pytest.mark.parametrize("how", ["at once", "growing"])
def test_writing_takes_little_memory_however_long_the_run_is(how: str, run: Run, tmp_path: Path) -> None:
    n = 600_000
    long_run = run.part(np.arange(n) % len(run)).replaced(t=0.01 * np.arange(n))
    size = sum(column.values.nbytes for column in long_run.columns())
    tracemalloc.start()
    try:
        if how == "growing":
            grown(long_run, tmp_path / "run.mcap", 4096)
        else:
            write_mcap(long_run, tmp_path / "run.mcap")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 0.25 * size, (peak, size)  # chunks, and a few bytes a sample
