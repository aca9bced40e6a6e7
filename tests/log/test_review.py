"""Reviewing a run: recordings are made, pictures taken, and what is missing is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinfmu.errors import LogError
from kinfmu.log import headless, review, write_mcap
from kinfmu.run import Run
from tests.log.runs import fourbar


@pytest.fixture
def mcap(run: Run, tmp_path: Path) -> Path:
    write_mcap(run, tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


def test_a_recording_is_saved_and_nothing_else(mcap: Path, tmp_path: Path) -> None:
    assert review(mcap, save=tmp_path / "saved.rrd") == tmp_path / "saved.rrd"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "saved.rrd"]


def test_two_runs_are_saved_as_one_recording(mcap: Path, tmp_path: Path) -> None:
    write_mcap(fourbar(np.arange(0.0, 181.0, 2.0)), tmp_path / "other.mcap")
    review(mcap, tmp_path / "other.mcap", save=tmp_path / "both.rrd")
    assert (tmp_path / "both.rrd").stat().st_size > 10_000


def test_without_a_display_it_says_what_else_can_be_done(mcap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(LogError, match=r"no display to open the viewer on; save .*--save F\.rrd.*--screenshot F\.png"):
        review(mcap)
    assert [path.name for path in mcap.parent.iterdir()] == ["run.mcap"]


def test_a_viewer_that_cannot_open_a_window_is_reported(mcap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":4711")
    with pytest.raises(LogError, match=r"run\.rrd: the viewer could not be opened: ") as caught:
        review(mcap)
    assert "\n" not in str(caught.value)


def test_what_is_no_run_is_refused(tmp_path: Path, mcap: Path) -> None:
    with pytest.raises(LogError, match=r"run\.csv: a run to review is an \.mcap or \.rrd file"):
        review(tmp_path / "run.csv")
    with pytest.raises(LogError, match=r"none\.mcap: there is no such file"):
        review(mcap, tmp_path / "none.mcap")
    review(mcap, save=tmp_path / "run.rrd")
    with pytest.raises(LogError, match=r"a recording cannot be compared; give the run's \.mcap file"):
        review(tmp_path / "run.rrd", mcap)


def test_a_machine_without_graphics_is_told_what_to_install(mcap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere.json")
    with pytest.raises(LogError, match="on Debian: apt-get install mesa-vulkan-drivers libvulkan1") as caught:
        review(mcap, screenshot=mcap.with_suffix(".png"))
    assert caught.value.no_graphics
    assert [path.name for path in mcap.parent.iterdir()] == ["run.mcap"]


@pytest.mark.usefixtures("graphics")
def test_a_picture_shows_the_linkage_in_its_colours(mcap: Path, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    assert review(mcap, screenshot=tmp_path / "shot.png") is None
    with image.open(tmp_path / "shot.png") as picture:
        width, height = picture.size
        pixels = np.asarray(picture.convert("RGB"), dtype=int).reshape(-1, 3)
    assert (width, height) == (1600, 900)
    for crank, coupler, rocker in [((230, 159, 0), (86, 180, 233), (0, 178, 130))]:
        for colour in (crank, coupler, rocker):
            assert (np.abs(pixels - colour).max(axis=1) <= 2).sum() > 500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "shot.png"]


@pytest.mark.usefixtures("graphics")
def test_the_viewer_is_gone_after_a_picture(mcap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ended = []
    end = headless._end
    monkeypatch.setattr(headless, "_end", lambda process: (end(process), ended.append(process.poll())))
    review(mcap, screenshot=tmp_path / "shot.png", at=0.0)
    assert len(ended) == 1
    assert ended[0] is not None
