"""Studies for a long time: killed at ten random moments, and a million designs."""

from __future__ import annotations

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kinfmu.design.study import StudyResult, read_study, run_study
from tests.design.study.linkage import write

KILLED = """
mechanism = "hoeken.toml"
designs = 6000
seed = 3
parameters.crank = { from = "15 mm", to = "25 mm" }
parameters.base = { tolerance = "0.3 mm" }
"""
KILLS = 10
LARGE = """
mechanism = "hoeken.toml"
report = ["swing"]
designs = {designs}
run = {{ from = "0 deg", to = "360 deg", samples = 13 }}
parameters.crank = {{ from = "15 mm", to = "25 mm" }}
parameters.base = {{ tolerance = "0.3 mm" }}
"""
MEASURED = """
import json, resource, sys
from kinfmu.design.study import read_study, run_study

result = run_study(read_study("study.toml", engine="native"), "study.parquet", workers=2)
own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
print(json.dumps([len(result), result.statistics["swing"].missing, own // 1024, children // 1024]))
"""
FLAT = 40  # [MB]


def test_a_study_that_is_killed_at_ten_random_moments_has_the_same_rows(tmp_path: Path) -> None:
    path = write(tmp_path, KILLED)
    moments = random.Random(5)  # noqa: S311  no secret
    command = [sys.executable, "-m", "kinfmu", "study", "study.toml", "--workers", "2", "--engine", "python"]
    parts: list[int] = []
    for kill in range(KILLS):
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if kill % 2:  # while it starts, or soon after
            time.sleep(moments.uniform(0.0, 1.5))
        else:  # while it measures
            before = written(tmp_path)
            while written(tmp_path) <= before:
                assert process.poll() is None
                time.sleep(0.001)
            time.sleep(moments.uniform(0.0, 0.5))
        assert process.poll() is None, f"the study ended before kill {kill}: give it more designs"
        process.kill()
        process.wait()
        parts.append(written(tmp_path))
    assert parts == sorted(parts)
    assert parts[-1] >= KILLS // 2
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")
    alone = tmp_path / "alone.parquet"
    run_study(read_study(path, engine="python"), alone, workers=1)
    assert (tmp_path / "study.parquet").read_bytes() == alone.read_bytes()


def written(folder: Path) -> int:
    """Return the number of parts on disk."""
    return len(list(folder.glob("study.parquet.parts/part-*")))


@pytest.mark.skipif(sys.platform == "win32", reason="resource is a module of Unix")
def test_a_million_designs_need_no_more_memory_than_a_few(tmp_path: Path) -> None:
    peaks = {}
    for designs in (150_000, 1_000_000):
        folder = tmp_path / str(designs)
        folder.mkdir()
        write(folder, LARGE.format(designs=designs))
        found = subprocess.run([sys.executable, "-c", MEASURED], cwd=folder, capture_output=True, text=True, check=True)
        count, missing, *peaks[designs] = json.loads(found.stdout)
        assert (count, missing) == (designs, 0)
        assert len(StudyResult.read(folder / "study.parquet")) == designs
    few, many = peaks[150_000], peaks[1_000_000]
    print(f"peak memory [MB] of this process and of its workers: {few} for 150 000 designs, {many} for 1 000 000")
    assert many[0] - few[0] < FLAT
    assert many[1] - few[1] < FLAT
