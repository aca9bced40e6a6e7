"""Designs of a study as a dataset of recordings."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.design.study.definition import define
from kinfmu.design.study.recordings import MOST_DESIGNS, chosen_rows, write_recordings
from kinfmu.design.study.run import run_study
from kinfmu.errors import RequestError
from kinfmu.log.viewer import reviewing
from kinfmu.log.viewer.dataset import _merged
from kinfmu.log.viewer.headless import executable
from kinfmu.log.viewer.series import Group
from tests.design.study.linkage import RANGES, linkage, write
from tests.log.viewer.test_rerun_file import documents, statics, verified

pytest.importorskip("rerun")
GRID = 'mechanism = "hoeken.toml"\nparameters.base = { values = [40, 45, 50] }\n'


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with recordings of three bases, the last of which another study left there."""
    folder = tmp_path_factory.mktemp("study")
    write(folder, GRID)
    (folder / "recs").mkdir()
    (folder / "recs" / "design_0099.rrd").write_bytes(b"of another study")
    command = ["study", str(folder / "study.toml"), "-o", str(folder / "s.csv"), "--workers", "1"]
    result = CliRunner().invoke(main, [*command, "--recordings", str(folder / "recs")])
    assert result.exit_code == 0, result.output
    assert f"recordings of 3 designs: {folder / 'recs'}; to compare them: kinfmu review " in result.stdout
    return folder / "recs"


def test_each_design_is_a_recording_with_its_numbers(dataset: Path) -> None:
    results = kinfmu.StudyResult.read(dataset.parent / "s.csv")
    for number, base in enumerate((40.0, 45.0, 50.0)):
        path = dataset / f"design_000{number}.rrd"
        assert verified(path)
        swing = float(f"{np.degrees(results['swing'][number]):.6g}")
        assert statics(path, "/__properties/design", "base [mm]") == [base]
        assert statics(path, "/__properties/design", "swing [deg]") == [swing]
        (text,) = documents(path, "/card")
        assert text.startswith(f"### hoeken, design 000{number}\n".replace("_", r"\_"))
        assert f"base \\[mm\\] = {base:g}, swing \\[deg\\] = {swing:g}, " in text
    assert len(list(dataset.iterdir())) == 3


def test_all_designs_are_drawn_to_one_scale_in_one_layout(dataset: Path) -> None:
    def printed(path: Path) -> str:
        command = [executable(), "rrd", "print", "-vvv", str(path)]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    def ranges(text: str) -> list[str]:
        """What the rows of chunks with a range hold, without their ids and times."""
        chunks = [chunk for chunk in text.split("\nChunk(") if re.search("(VisualBounds2D|ScalarAxis):range", chunk)]
        rows = (line for chunk in chunks for line in chunk.splitlines() if "│ row_" in line)
        return sorted(row.split("┆")[-1].strip(" │") for row in rows)

    layouts = [ranges(printed(path)) for path in sorted(dataset.iterdir())]
    assert re.fullmatch(r"\[\[-?[\d.]+, -?[\d.]+\]\]", layouts[0][0])
    assert layouts[0][-1].startswith("[{x_range: [")
    assert len(layouts[0]) > 3
    assert layouts[0] == layouts[1] == layouts[2]
    assert all("kinfmu_study_hoeken" in printed(path) for path in dataset.iterdir())


def test_of_many_designs_those_with_extremes_are_recorded() -> None:
    result = run_study(define(linkage(), RANGES, designs=64), workers=1)
    rows = chosen_rows(result)
    assert MOST_DESIGNS - len(result.measures) <= len(rows) <= MOST_DESIGNS
    for name in result.measures:
        assert {int(np.nanargmin(result[name])), int(np.nanargmax(result[name]))} <= set(rows)


def test_designs_at_their_own_speeds_have_one_axis(tmp_path: Path) -> None:
    study = define(linkage(), {"crank.speed": {"values": ["30 rpm", "60 rpm"]}})
    paths = write_recordings(study, run_study(study, workers=1), tmp_path)
    for path, speed in zip(paths, (30.0, 60.0), strict=True):
        assert statics(path, "/__properties/design", "crank.speed [rpm]") == [speed]


def test_a_folder_is_reviewed_as_a_dataset(dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Path] = []
    monkeypatch.setattr(reviewing, "_need_display", lambda _: None)
    monkeypatch.setattr(reviewing, "_open", lambda *recordings: opened.extend(recordings))
    assert CliRunner().invoke(main, ["review", str(dataset)]).exit_code == 0
    assert [path.name for path in opened] == [f"design_000{k}.rrd" for k in range(3)]
    with pytest.raises(RequestError, match="holds 0 recordings"):
        kinfmu.log.review(tmp_path)
    with pytest.raises(RequestError, match="a folder of recordings is shown as it is"):
        kinfmu.log.review(dataset, save=tmp_path / "a.rrd")


def test_designs_that_lock_do_not_flatten_the_scale_of_the_others() -> None:
    groups = [
        Group("velocity/angle", "angular velocity [deg/s]", ("a",), ((0, 0, 0),), np.array(values)[:, None])
        for values in ([0.0, 1.0, 2.0], [0.0, 500.0, np.nan], [0.5, 1.0, 3.0])
    ]
    low, high = _merged(groups).shown or (0.0, 0.0)
    assert (low, high) == pytest.approx((0.0, 3.0), abs=0.3)
    assert (_merged(groups[1:2]).shown or (0.0, 0.0))[1] >= 500.0
