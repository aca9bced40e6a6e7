"""A study that is killed goes on where it was, and its rows are the same."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.design.study import read_study, run_study
from kinfmu.errors import StudyError
from tests.design.study.linkage import RANGES, linkage, write

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
