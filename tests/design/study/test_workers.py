"""Studies by several processes, stopped and resumed."""

from __future__ import annotations

import io
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.design.study import read_study, run_study
from kinfmu.design.study.definition import define
from kinfmu.design.study.job import Job, run_chunk
from kinfmu.errors import StudyError
from tests.design.study.linkage import RANGES, linkage, write

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


# -------------------------------------------------------------------------------------------------------------- resumed


STUDY = """
mechanism = "hoeken.toml"
designs = 480
report = ["swing"]
run = { from = "0 deg", to = "360 deg", samples = 46 }
parameters.crank = { from = "15 mm", to = "25 mm" }
parameters.base = { tolerance = "0.3 mm" }
"""
COMMAND = [sys.executable, "-m", "kinfmu", "study", "study.toml", "--workers", "2", "--engine", "python"]


def killed(folder: Path, parts: int) -> int:
    """Run the study until so many of its parts are written, and kill it; return how many there are then."""
    process = subprocess.Popen(COMMAND, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120.0
    while len(list(folder.glob("study.parquet.parts/part-*"))) < parts and time.monotonic() < end:
        assert process.poll() is None
        time.sleep(0.002)
    process.kill()
    process.wait()
    return len(list(folder.glob("study.parquet.parts/part-*")))


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="counts processes in /proc")
@pytest.mark.long
def test_a_study_that_is_killed_has_the_same_rows(tmp_path: Path) -> None:
    path = write(tmp_path, STUDY)
    assert 3 <= killed(tmp_path, 3) < 15
    ended = subprocess.run(COMMAND, cwd=tmp_path, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert {one.name for one in tmp_path.iterdir()} == {"hoeken.toml", "study.toml", "study.parquet"}
    alone = tmp_path / "alone.parquet"
    run_study(read_study(path, engine="python"), alone, workers=1)
    assert (tmp_path / "study.parquet").read_bytes() == alone.read_bytes()
    end = time.monotonic() + 20.0
    while _processes_in(tmp_path) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _processes_in(tmp_path), "workers of a killed study are left"


def _processes_in(folder: Path) -> list[str]:
    """Return the processes whose working folder this is."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cwd").resolve() == folder.resolve() and "zombie" not in (process / "status").read_text():
                found.append(process.name)
        except OSError:  # ended meanwhile, or of another user
            continue
    return found


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The parts of a study of 160 designs that is left after its second part, as Ctrl-C does."""

    def stop(done: int, _count: int) -> None:
        if done >= 64:
            raise KeyboardInterrupt

    path = tmp_path_factory.mktemp("left") / "rows.parquet"
    with pytest.raises(KeyboardInterrupt):
        kinfmu.study(linkage(), RANGES, measures="swing", designs=160, output=path, workers=1, progress=stop)
    return path.with_name("rows.parquet.parts")


@pytest.fixture
def interrupted(left: Path, tmp_path: Path) -> Path:
    """The file of an interrupted study."""
    shutil.copytree(left, tmp_path / left.name)
    return tmp_path / "rows.parquet"


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The content of the file of that study if nothing interrupts it."""
    path = tmp_path_factory.mktemp("alone") / "rows.parquet"
    kinfmu.study(linkage(), RANGES, measures="swing", designs=160, output=path, workers=1)
    return path.read_bytes()


def test_parts_that_are_whole_are_kept_and_damaged_ones_measured_again(interrupted: Path) -> None:
    folder = interrupted.with_name("rows.parquet.parts")
    (folder / ".part-0000000064.12345678.npz").write_bytes(b"half")
    begins: list[int] = []
    (folder / "part-0000000032.npz").write_bytes(b"damaged")
    found = kinfmu.study(
        linkage(),
        RANGES,
        measures="swing",
        designs=160,
        output=interrupted,
        workers=1,
        progress=lambda done, _: begins.append(done),
    )
    assert begins[0] == 32
    assert found["design"].tolist() == list(range(160))
    assert not folder.exists()


def test_a_study_that_ended_before_its_parts_were_joined_is_finished(tmp_path: Path) -> None:
    path = tmp_path / "rows.parquet"
    path.mkdir()
    given = {"measures": "swing", "designs": 64, "output": path, "engine": "python"}
    with pytest.raises(StudyError, match=r"rows\.parquet: cannot be written \(Is a directory\)"):
        kinfmu.study(linkage(), RANGES, workers=1, **given)  # type: ignore[arg-type]
    path.rmdir()
    found = kinfmu.study(linkage(), RANGES, workers=2, **given)  # type: ignore[arg-type]
    assert found["design"].tolist() == list(range(64))


@pytest.mark.parametrize("damage", ["another part", "a changed byte", "other columns"])
@pytest.mark.few(1)
def test_a_part_with_other_content_is_never_joined(damage: str, interrupted: Path, alone: bytes) -> None:
    given = {"measures": "swing", "designs": 160, "workers": 1, "output": interrupted}
    first, second = sorted(interrupted.with_name("rows.parquet.parts").glob("part-*"))[:2]
    if damage == "another part":
        second.write_bytes(first.read_bytes())
    elif damage == "other columns":
        second.write_bytes(_without_a_column(second))
    else:
        content = bytearray(second.read_bytes())
        content[content.index(b"\x93NUMPY") + 140] ^= 1  # of the first column, after its header
        second.write_bytes(content)
    with pytest.raises(StudyError, match=r"part-0000000032\.npz: cannot be read .* the same command measures it"):
        kinfmu.study(linkage(), RANGES, **given)  # type: ignore[arg-type]
    kinfmu.study(linkage(), RANGES, **given)  # type: ignore[arg-type]
    assert interrupted.read_bytes() == alone


def _without_a_column(path: Path) -> bytes:
    file = io.BytesIO()
    with np.load(path) as part:
        np.savez(file, allow_pickle=False, **{name: part[name] for name in part if name != "swing"})
    return file.getvalue()


def test_parts_that_a_finished_study_left_are_removed(left: Path, alone: bytes, tmp_path: Path) -> None:
    path = tmp_path / "rows.parquet"
    path.write_bytes(alone)
    shutil.copytree(left, tmp_path / left.name)
    kinfmu.study(linkage(), RANGES, measures="swing", designs=160, output=path, workers=1)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == alone


def test_parts_of_another_study_are_refused_until_they_are_removed(interrupted: Path) -> None:
    again = {"measures": "swing", "output": interrupted, "workers": 1}
    with pytest.raises(StudyError) as error:
        kinfmu.study(linkage(), RANGES, designs=170, **again)  # type: ignore[arg-type]
    assert str(error.value) == (
        f"{interrupted}.parts holds parts of another study (samples: 160 there, 170 here); continue that one, choose "
        f"another file with -o, or remove them with --restart"
    )
    with pytest.raises(StudyError, match=r"another study \(the mechanism or the version of kinfmu differs\)"):
        kinfmu.study(linkage().with_parameters({"rocker": 51}), RANGES, designs=160, **again)  # type: ignore[arg-type]
    found = kinfmu.study(linkage(), RANGES, designs=170, restart=True, **again)  # type: ignore[arg-type]
    assert len(found) == 170


def test_a_file_of_something_else_in_the_place_of_the_results_is_kept(interrupted: Path, alone: bytes) -> None:
    path = interrupted.with_name("kept.parquet")
    given = {"measures": "swing", "output": path, "workers": 1}

    def refused(designs: int, reason: str) -> None:
        before = path.read_bytes()
        with pytest.raises(StudyError) as error:
            kinfmu.study(linkage(), RANGES, designs=designs, **given)  # type: ignore[arg-type]
        assert str(error.value) == f"{path} {reason}; choose another file with -o, or replace it with --restart"
        assert path.read_bytes() == before
        assert not path.with_name("kept.parquet.parts").exists()

    path.write_text("my notes")
    refused(160, "is not the results of a study")
    pq = pytest.importorskip("pyarrow.parquet")
    path.write_bytes(alone)
    pq.write_table(pq.read_table(path).replace_schema_metadata({}), path)
    refused(160, "is not the results of a study")
    path.write_bytes(alone)
    refused(170, "holds the results of another study (samples: 160 there, 170 here)")
    assert len(kinfmu.study(linkage(), RANGES, designs=160, **given)) == 160  # type: ignore[arg-type]
    assert path.read_bytes() == alone
    assert len(kinfmu.study(linkage(), RANGES, designs=170, restart=True, **given)) == 170  # type: ignore[arg-type]
    shutil.copytree(interrupted.with_name("rows.parquet.parts"), path.with_name("kept.parquet.parts"))
    kinfmu.study(linkage(), RANGES, designs=160, **given)  # type: ignore[arg-type]  # begun with restart, then ended
    assert path.read_bytes() == alone


def test_two_commands_do_not_run_one_study_at_the_same_time(tmp_path: Path) -> None:
    path = tmp_path / "rows.parquet"

    def begin_again(_done: int, _count: int) -> None:
        with pytest.raises(StudyError, match="a study in progress writes there"):
            kinfmu.study(linkage(), RANGES, designs=32, output=path, workers=1)

    kinfmu.study(linkage(), RANGES, designs=32, output=path, workers=1, progress=begin_again)
