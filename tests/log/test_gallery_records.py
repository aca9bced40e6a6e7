"""Records of every mechanism of the gallery: complete for other readers, and read back unchanged."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader

import kinfmu
from kinfmu.log import McapLog, read, write_mcap, write_rrd
from kinfmu.log.viewer.headless import executable
from kinfmu.run import Run
from kinfmu.run.channels import select
from tests.gallery_members import every_member
from tests.log.runs import fourbar, without_samples
from tests.log.test_mcap import assert_same

DRAWN = {"/joint_states", "/joint_accelerations", "/robot_description", "/tf"}


def solved(name: str) -> Run:
    mechanism = kinfmu.load(name)
    run = kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, 60))
    return run.part(slice(None), events=run.events)


@every_member
@pytest.mark.few(4)
def test_a_mechanism_of_the_gallery_is_recorded_with_all_that_draws_it(name: str, tmp_path: Path) -> None:
    run, path = solved(name), tmp_path / "run.mcap"
    sink = McapLog(path)
    sink.begin(without_samples(run))
    for start in range(0, 60, 25):
        sink.add(run.part(slice(start, start + 25), events=run.events if start == 50 else ()))
    sink.end(run, "")
    assert_same(run, read(path))
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages())
        summary = reader.get_summary()
    assert summary.statistics.message_count == count
    assert {channel.topic for channel in summary.channels.values()} == {"/sample", "/log", *DRAWN}
    with path.open("rb") as file:
        assert sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages()) == count
    process = subprocess.run(
        [executable(), "mcap", "check", "--full", str(path)], capture_output=True, text=True, check=True
    )
    rows = [line.split() for line in process.stdout.splitlines() if "/" in line and "ID" not in line]
    assert {row[0] for row in rows[1:]} == {"ok"}


@pytest.mark.parametrize(
    "channels", [["none"], ["q"], ["-qd", "-margin"], ["residual", "coupler.*"], ["points", "error"]], ids=" ".join
)
@pytest.mark.few(3)
def test_a_recording_is_made_of_what_was_kept(channels: list[str], tmp_path: Path) -> None:
    write_mcap(fourbar(np.arange(181.0)), tmp_path / "run.mcap", channels=channels)
    run = read(tmp_path / "run.mcap")
    assert_same(run, select(fourbar(np.arange(181.0)), channels))
    write_rrd(run, tmp_path / "run.rrd")
    subprocess.run([executable(), "rrd", "verify", str(tmp_path / "run.rrd")], check=True, capture_output=True)
