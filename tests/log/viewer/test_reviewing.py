"""Reviewing a run: recordings, the live view, and an installation without the viewer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.image import imread

import kinfmu
from kinfmu.cli import main
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.strokes import STROKES
from kinfmu.errors import LogError, RequestError
from kinfmu.log import LiveView, read, review, write_mcap, write_rrd
from kinfmu.log.viewer import headless, live, reviewing
from kinfmu.log.viewer.timeline import timeline_named, timeline_of
from kinfmu.run import Run
from tests.log.runs import fourbar
from tests.log.viewer.test_rerun_file import documents, rows


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


def test_runs_that_cannot_be_compared_are_reported_under_the_users_file_name(mcap: Path, tmp_path: Path) -> None:
    write_mcap(kinfmu.solve(kinfmu.load("slider_crank")), tmp_path / "other.mcap")
    for asked in ({"screenshot": "a.png"}, {"save": "a.rrd"}):
        (name,) = asked.values()
        with pytest.raises(LogError, match=rf"^{name}: the runs measure lengths in m and mm; they need the same unit$"):
            review(mcap, tmp_path / "other.mcap", **asked)


def test_without_a_display_the_alternatives_are_reported(mcap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(LogError, match=r"no display to open the viewer on; save .*--save F\.rrd.*--screenshot F\.png"):
        review(mcap)
    assert [path.name for path in mcap.parent.iterdir()] == ["run.mcap"]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the display has no name to get wrong")
def test_a_viewer_that_cannot_open_a_window_is_reported(mcap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":4711")
    with pytest.raises(LogError, match=r"run\.rrd: the viewer could not be opened: ") as caught:
        review(mcap)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for the viewer is a shell script")
def test_a_viewer_that_opens_keeps_running_on_a_recording_in_the_folder_of_the_run(
    mcap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = tmp_path / "viewer"
    viewer.write_text('#!/bin/sh\necho "$@" >&2\nexec cat "$FIFO"\n')  # waits until somebody writes to the pipe
    viewer.chmod(0o700)
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setenv("FIFO", str(tmp_path / "pipe"))
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(reviewing, "executable", lambda: str(viewer))
    monkeypatch.setattr(reviewing, "FAILS_WITHIN", 0.2)
    assert review(mcap) == mcap.with_suffix(".rrd")
    process = reviewing._VIEWERS.pop()
    assert process.poll() is None
    assert process.args == [str(viewer), "--bind", "127.0.0.1", str(mcap.with_suffix(".rrd"))]
    process.kill()
    process.wait()


def test_a_file_that_is_not_a_run_is_refused(tmp_path: Path, mcap: Path) -> None:
    with pytest.raises(RequestError, match=r"run\.csv: a run to review is an \.mcap or \.rrd file"):
        review(tmp_path / "run.csv")
    with pytest.raises(RequestError, match=r"shot\.jpg: the name must end in \.png"):
        review(mcap, screenshot=tmp_path / "shot.jpg")
    with pytest.raises(RequestError, match=r"none\.mcap: there is no such file"):
        review(mcap, tmp_path / "none.mcap")
    review(mcap, save=tmp_path / "run.rrd")
    with pytest.raises(RequestError, match=r"a recording cannot be compared; give the run's \.mcap file"):
        review(tmp_path / "run.rrd", mcap)
    with pytest.raises(RequestError, match=r"at = 4 is the time of a screenshot, and none is asked for"):
        review(mcap, save=tmp_path / "run.rrd", at=4.0)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere graphics are not from Vulkan")
def test_on_a_machine_without_graphics_the_package_to_install_is_reported(
    mcap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere.json")
    with pytest.raises(
        LogError, match=r"scripts/graphics .* or apt-get install mesa-vulkan-drivers libvulkan1"
    ) as caught:
        review(mcap, screenshot=mcap.with_suffix(".png"))
    assert caught.value.no_graphics
    assert [path.name for path in mcap.parent.iterdir()] == ["run.mcap"]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere graphics are not from Vulkan")
def test_a_viewer_that_cannot_draw_is_reported_before_it_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nowhere.json")
    with pytest.raises(LogError, match="no graphics driver"), headless.viewer((320, 200)):
        pytest.fail("a viewer was given that cannot draw")


@pytest.mark.usefixtures("graphics")
@pytest.mark.long
def test_a_picture_shows_the_linkage_in_its_colours_and_the_viewer_is_gone(
    mcap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    image = pytest.importorskip("PIL.Image")
    ended = []
    end = headless._end
    monkeypatch.setattr(headless, "_end", lambda process: (end(process), ended.append(process.poll())))
    assert review(mcap, screenshot=tmp_path / "shot.png") is None
    assert len(ended) == 1
    assert ended[0] is not None
    with image.open(tmp_path / "shot.png") as picture:
        size = picture.size
        pixels = np.asarray(picture.convert("RGB"), dtype=int).reshape(-1, 3)
    assert size == (1600, 900)
    inside = STROKES["link"][-1].line
    for colour in palette.BODIES[:3]:
        assert (np.abs(pixels - palette.tint(inside, colour, is_dark=True)).max(axis=1) <= 2).sum() > 500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "shot.png"]


@pytest.mark.parametrize(
    ("name", "unit", "label", "value", "place"),
    [
        ("sim_time", "s", "t [s]", 2.5, 2.5),
        ("crank [deg]", "deg", "crank [deg]", np.pi / 4.0, 45.0),
        ("crank [0.01 deg]", "deg", "crank [deg]", np.pi / 4.0, 4500.0),
        ("piston [0.1 mm]", "mm", "piston [mm]", 12.5, 125.0),
        ("sample", "", "sample", 7.0, 7.0),
    ],
)
def test_a_timeline_is_known_by_its_name(name: str, unit: str, label: str, value: float, place: float) -> None:
    timeline = timeline_named(name)
    assert (timeline.unit, timeline.label) == (unit, label)
    assert timeline.place(value) == pytest.approx(place, rel=1e-15)


@pytest.mark.usefixtures("graphics")
@pytest.mark.long
def test_at_of_a_recording_over_a_driver_is_the_drivers_value(tmp_path: Path) -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.radians(np.arange(0.0, 90.5, 0.5)))
    recording, record = tmp_path / "run.rrd", tmp_path / "run.mcap"
    write_rrd(run, recording)
    write_mcap(run, record)
    assert timeline_of([run]) == timeline_named("crank [0.1 deg]")
    for source in (recording, record):
        picture = tmp_path / f"{source.suffix[1:]}.png"
        result = CliRunner().invoke(main, ["review", str(source), "--screenshot", str(picture), "--at", "45.5deg"])
        assert result.exit_code == 0, result.output
    pictures = [imread(tmp_path / f"{kind}.png") for kind in ("rrd", "mcap")]  # of 0 to 1
    np.testing.assert_allclose(*pictures, rtol=0.0, atol=0.05)  # drawn twice they differ by a few levels
    with pytest.raises(RequestError, match=r"at = 100 is outside the recording, crank \[deg\] = 0 to 90$"):
        review(recording, screenshot=tmp_path / "none.png", at=np.radians(100.0))
    assert not (tmp_path / "none.png").exists()


# ----------------------------------------------------------------------------------------------------------------- live


rr = pytest.importorskip("rerun")


def test_pieces_of_a_run_are_in_the_stream_once_with_layout_and_card(tmp_path: Path) -> None:
    path = tmp_path / "live.rrd"
    stream = rr.RecordingStream("kinfmu_test", recording_id="live")
    stream.save(path)
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 2.0, 41))
    view, sent = LiveView(stream), []
    view.begin(run.part(slice(0, 0)))
    for start in (0, 10, 25):
        view.add(run.part(slice(start, {0: 10, 10: 25, 25: 41}[start])))
        sent.append(path.stat().st_size)
    assert 0 < sent[0] < sent[1] < sent[2]  # a viewer has it before the run ends
    view.end(run, "")
    stream.disconnect()
    assert path.stat().st_size > sent[2]
    times = list(np.rint(run.t * 1e9))
    assert [t for t, _ in rows(path, "/position/angle", "Scalars:scalars")] == times
    assert [t for t, _ in rows(path, "/linkage/bodies/crank", "Transform3D:translation")] == times
    assert documents(path, "/card")[0].startswith("#")


def test_a_viewer_that_is_closed_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "ANSWER_TIME", 0.2)
    stream = rr.RecordingStream("kinfmu_test", recording_id="closed")
    flushed: list[float] = []

    def lost(*, timeout_sec: float) -> None:
        flushed.append(timeout_sec)
        raise RuntimeError("no viewer")

    monkeypatch.setattr(stream, "flush", lost)
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 1.0, 5))
    view = LiveView(stream)
    view.begin(run.part(slice(0, 0)))
    view.add(run)
    view.add(run)
    view.end(run, "")
    assert flushed == [0.2]  # nothing is sent after that


def test_without_display_and_viewer_the_message_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live, "PORT", 1)  # nothing listens there
    monkeypatch.setattr(live.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(LogError, match=r"^there is no display to open the viewer on; .*--screenshot F\.png$"):
        LiveView()


# ------------------------------------------------------------------------------------------------------- without viewer


BASE = (  # a process in which the packages of the extras cannot be imported
    "import sys; sys.modules.update(dict.fromkeys(('rerun', 'rerun_bindings', 'rerun_cli', 'PIL', 'matplotlib')))\n"
)
INSTALL = "needs the Rerun viewer: pip install 'kinfmu[viewer]'"


def outcomes(folder: Path, *commands: str) -> list[tuple[int, str, str]]:
    """Return exit status, output and errors of commands, which run one after another in one process."""
    code = f"""{BASE}
import json
from click.testing import CliRunner
from kinfmu.cli import main
results = [CliRunner().invoke(main, command.split(), prog_name="kinfmu") for command in sys.argv[1:]]
print(json.dumps([(one.exit_code, one.stdout, one.stderr) for one in results]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code, *commands], cwd=folder, capture_output=True, text=True, check=True
    )
    return [tuple(outcome) for outcome in json.loads(done.stdout)]


def test_simulate_writes_the_record_alone_and_reports_it(tmp_path: Path) -> None:
    ((status, out, err),) = outcomes(tmp_path, "simulate fourbar --stop 3")
    assert (status, err) == (0, "")
    first, second = out.splitlines()
    assert first.endswith("; written to logs/fourbar.mcap")
    assert second == f"no recording, which {INSTALL}"
    assert [path.name for path in (tmp_path / "logs").iterdir()] == ["fourbar.mcap"]
    assert len(read(tmp_path / "logs" / "fourbar.mcap")) == 4
    (tmp_path / "logs" / "fourbar.rrd").write_bytes(b"older")
    tables = ("run.csv", "run.parquet")
    again, without, *exports = outcomes(
        tmp_path,
        "simulate fourbar --stop 2",
        "simulate fourbar --stop 2 --channels none",
        *(f"export logs/fourbar.mcap -o {name}" for name in tables),
    )
    assert (again[0], again[2]) == (0, "")
    assert again[1].splitlines()[1] == f"no recording, which {INSTALL}; logs/fourbar.rrd is of an older run"
    assert (without[0], without[2], len(without[1].splitlines())) == (0, "", 1)
    assert exports == [(0, f"written: {name}\n", "") for name in tables]


def test_what_needs_the_viewer_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    refused = {
        "simulate fourbar --rrd a.rrd": "a.rrd: a recording",
        "simulate fourbar --live": "--live",
        "review run.mcap": "run.mcap: a review",
        "review run.mcap --screenshot a.png": "run.mcap: a review",
    }
    (tmp_path / "run.mcap").touch()
    assert outcomes(tmp_path, *refused) == [(1, "", f"kinfmu: {what} {INSTALL}\n") for what in refused.values()]
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_so_are_the_functions_of_the_log(tmp_path: Path) -> None:
    code = f"""{BASE}
import kinfmu
from kinfmu.errors import MissingPackageError
from kinfmu.log.viewer.comparison import write_comparison
run = kinfmu.solve(kinfmu.load("fourbar"), [0.0, 1.0])
for call in (
    lambda: kinfmu.log.write_rrd(run, "a.rrd"), lambda: write_comparison(run, run, "a.rrd"), kinfmu.log.LiveView
):
    try:
        call()
    except MissingPackageError as error:
        print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    recording = f"a.rrd: a recording {INSTALL}"
    assert done.stdout.splitlines() == [recording, recording, f"the live view {INSTALL}"]
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_so_is_the_recording_of_the_demo(tmp_path: Path) -> None:
    code = f"{BASE}from kinfmu.cli import demo; sys.exit(demo.main())"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"wrote logs/fourbar.mcap; no recording: logs/fourbar.rrd: a recording {INSTALL}" in done.stdout
    assert "no picture: logs/fourbar.gif: " in done.stdout
