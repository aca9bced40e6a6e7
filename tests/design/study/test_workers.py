"""Who measures a study does not change its rows, whatever happens to them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.design.study import run_study
from kinfmu.design.study.definition import define
from kinfmu.design.study.job import Job, run_chunk
from kinfmu.errors import StudyError
from tests.design.study.linkage import RANGES, linkage

DESIGNS = 160  # five parts
needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="distributed is not installed (extra dask)")
quiet = pytest.mark.filterwarnings("ignore::DeprecationWarning:distributed", "ignore::DeprecationWarning:dask")


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The content of the file that this process alone writes."""
    return study(tmp_path_factory.mktemp("alone"), workers=1)


def study(folder: Path, **settings: Any) -> bytes:
    path = folder / "rows.parquet"
    kinfmu.study(linkage(), RANGES, measures="swing", designs=DESIGNS, seed=2, output=path, **settings)
    assert [one.name for one in folder.iterdir()] == [path.name]
    return path.read_bytes()


def test_processes_give_the_same_bytes(rows: bytes, tmp_path: Path) -> None:
    assert study(tmp_path, workers=2) == rows


def test_the_engine_is_part_of_the_study_and_gives_the_same_numbers() -> None:
    both = [
        kinfmu.study(linkage(), RANGES, measures="swing", designs=40, engine=engine, workers=1)["swing"]
        for engine in ("python", "native")
    ]
    assert both[0] == pytest.approx(both[1], rel=1e-12)
    native = [define(linkage(), RANGES, designs=40, engine=engine).fingerprint for engine in ("python", "native")]
    assert native[0] != native[1]


@pytest.mark.parametrize("engine", ["python", "native"])
def test_the_numbers_of_a_design_do_not_depend_on_those_measured_with_it(engine: str) -> None:
    study = define(linkage(), RANGES, designs=40, engine=engine)
    job = Job.of(study)
    whole = job.measure(study.sampling.values(0, 40))
    for first, count in ((0, 1), (1, 7), (8, 32)):
        part = job.measure(study.sampling.values(first, count))
        for name in study.measures:
            assert np.array_equal(part.values[name], whole.values[name][first : first + count])
            assert np.array_equal(part.at[name], whole.at[name][first : first + count])


@needs_dask
@quiet
@pytest.mark.long
def test_a_local_cluster_gives_the_same_bytes(rows: bytes, tmp_path: Path) -> None:
    assert study(tmp_path, workers=2, dask="local") == rows


@pytest.fixture
def scheduler() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The address of a scheduler with two workers, and their processes."""
    import distributed

    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address]
        settings = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
        workers = [
            subprocess.Popen([*command, *settings], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for _ in range(2)
        ]
        with distributed.Client(cluster) as client:
            client.wait_for_workers(2, timeout=60)
        yield cluster.scheduler_address, workers
        for one in workers:
            one.kill()
            one.wait()


@needs_dask
@quiet
@pytest.mark.long
def test_a_worker_of_a_cluster_that_is_killed_does_not_change_them(
    rows: bytes, tmp_path: Path, scheduler: tuple[str, list[subprocess.Popen[bytes]]]
) -> None:
    address, workers = scheduler
    killed: list[int] = []

    def kill_one(done: int, _count: int) -> None:
        if done and not killed:
            workers[0].send_signal(signal.SIGKILL)
            killed.append(done)

    assert study(tmp_path, dask=address, progress=kill_one) == rows
    assert 0 < killed[0] < DESIGNS
    assert (workers[0].wait(), workers[1].poll()) == (-signal.SIGKILL, None)


@needs_dask
@quiet
def test_a_cluster_gives_the_same_bytes_and_if_it_is_lost_the_parts_are_kept(rows: bytes, tmp_path: Path) -> None:
    import distributed

    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        (tmp_path / "whole").mkdir()
        assert study(tmp_path / "whole", dask=cluster.scheduler_address) == rows

        def lose(done: int, _count: int) -> None:
            if done:
                cluster.close()

        with pytest.raises(StudyError, match="the Dask cluster was lost; the same command goes on"):
            study(tmp_path, dask=cluster.scheduler_address, progress=lose)
    assert len(list(tmp_path.glob("rows.parquet.parts/part-*"))) >= 1


@needs_dask
@quiet
@pytest.mark.parametrize("lost", [("error", None, None, "more"), None])
def test_a_cluster_that_is_lost_between_two_looks_is_named(
    lost: tuple[object, ...] | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import distributed

    async def result(_self: object, *, raiseit: bool) -> object:
        assert not raiseit
        return lost

    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        monkeypatch.setattr(distributed.Future, "_result", result)
        monkeypatch.setattr(distributed.Future, "status", "lost")
        with pytest.raises(StudyError, match="the Dask cluster was lost; the same command goes on"):
            study(tmp_path, dask=cluster.scheduler_address)


@needs_dask
@quiet
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_does_not_answer_is_named(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import distributed

    whole = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda *given, **_: whole(*given, timeout="1s"))
    with pytest.raises(StudyError, match=f"the Dask scheduler at '{address}' cannot be reached"):
        study(tmp_path, dask=address)


@pytest.mark.long
def test_a_worker_process_that_is_killed_ends_the_study_which_goes_on_later(rows: bytes, tmp_path: Path) -> None:
    import multiprocessing

    def kill_one(done: int, _count: int) -> None:
        for process in multiprocessing.active_children()[: min(done, 1)]:  # none is left when the loss is known
            os.kill(process.pid or 0, signal.SIGKILL)

    with pytest.raises(StudyError, match="a worker process ended unexpectedly"):
        study(tmp_path, workers=2, progress=kill_one)
    assert [path.name for path in tmp_path.iterdir()] == ["rows.parquet.parts"]
    kept: list[int] = []
    path = tmp_path / "rows.parquet"
    defined = define(linkage(), RANGES, measures="swing", designs=DESIGNS, seed=2)
    run_study(defined, path, workers=1, progress=lambda done, _: kept.append(done))
    assert kept[0] >= 32
    assert path.read_bytes() == rows


def test_a_worker_with_another_version_is_refused() -> None:
    with pytest.raises(StudyError, match=r"a worker has kinfmu .*, and this is kinfmu 9\.9"):
        run_chunk(b"", "9.9", {})


@pytest.mark.long
def test_a_script_without_a_guard_is_not_run_again_by_the_workers(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import kinfmu\n"
        "from tests.design.study.linkage import RANGES, linkage\n"
        "print(len(kinfmu.study(linkage(), RANGES, designs=64, workers=2)))\n"
    )
    root = Path(__file__).parents[3]
    command = [sys.executable, str(script)]
    ended = subprocess.run(
        command, cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True, text=True
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "64\n", "")
