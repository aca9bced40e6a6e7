"""One record name serves one run at a time: a second one is refused until the first has ended."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from kinfmu import files as whole_file
from kinfmu.errors import LogError
from kinfmu.log import McapLog, read, recover, write_mcap
from kinfmu.run import Run
from tests.log.runs import without_samples
from tests.log.test_mcap import assert_same

REFUSED = r"run\.mcap: cannot be written \(a run in progress writes to it; choose another name, or wait until it has"
pytestmark = pytest.mark.skipif(
    whole_file.fcntl is None, reason="without locks Windows refuses to replace an open file"
)


@pytest.fixture
def growing(run: Run, tmp_path: Path) -> Iterator[McapLog]:
    """A record that has its first samples."""
    sink = McapLog(tmp_path / "run.mcap")
    sink.begin(without_samples(run))
    sink.add(run.part(slice(0, 10)))
    yield sink
    sink.close()


def test_a_second_run_of_the_same_name_is_refused_before_its_first_sample(growing: McapLog, run: Run) -> None:
    with pytest.raises(LogError, match=REFUSED):
        McapLog(growing.path).begin(without_samples(run))
    growing.add(run.part(slice(10, None)))
    growing.end(run, "")
    assert_same(run, read(growing.path))


def test_of_two_runs_that_begin_at_once_the_first_with_samples_is_written(run: Run, tmp_path: Path) -> None:
    first, second = McapLog(tmp_path / "run.mcap"), McapLog(tmp_path / "run.mcap")
    for sink in (first, second):
        sink.begin(without_samples(run))
    first.add(run)
    with pytest.raises(LogError, match=REFUSED):
        second.add(run.part(slice(0, 3)))
    first.end(run, "")
    assert_same(run, read(tmp_path / "run.mcap"))
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_no_other_command_replaces_a_run_that_is_being_written(growing: McapLog, run: Run) -> None:
    with pytest.raises(LogError, match=REFUSED):
        write_mcap(run, growing.path)
    assert len(recover(growing.path, growing.path.with_name("found.mcap"))) == 10


@pytest.mark.parametrize("how", ["ended", "closed", "read"])
def test_the_name_is_free_after_the_run(how: str, growing: McapLog, run: Run) -> None:
    if how == "read":
        growing.end(run.part(slice(0, 10)), "")
        read(growing.path)
    elif how == "ended":
        growing.end(run.part(slice(0, 10)), "")
    else:
        growing.close()
    write_mcap(run, growing.path)
    assert_same(run, read(growing.path))


HELD = """
import sys, time
from kinfmu.log import McapLog, read
run = read(sys.argv[1])
sink = McapLog(sys.argv[2])
sink.begin(run.part(slice(0, 0)))
sink.add(run)
print("begun", flush=True)
time.sleep(60)
"""


def test_a_run_of_another_process_holds_its_name_until_the_process_ends(run: Run, tmp_path: Path) -> None:
    write_mcap(run, tmp_path / "source.mcap")
    path = tmp_path / "run.mcap"
    command = [sys.executable, "-c", HELD, str(tmp_path / "source.mcap"), str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        with pytest.raises(LogError, match=REFUSED):
            McapLog(path).begin(without_samples(run))
        process.kill()
    write_mcap(run, path)
    assert_same(run, read(path))
