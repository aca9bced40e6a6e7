"""Review of a run: open it in the Rerun viewer, save the recording, or take a picture."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from kinfmu.errors import LogError, RequestError
from kinfmu.files import suffix_of, temporary_folder
from kinfmu.log.reading import read
from kinfmu.log.target import replacing
from kinfmu.log.viewer.headless import Cursor, CursorOn, executable, last_error, shoot
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.rerun_file import write_rrd
from kinfmu.log.viewer.timeline import Timeline, timeline_named, timeline_of
from kinfmu.run.axis import axis_of

if TYPE_CHECKING:
    from rerun.experimental import Timeline as ShownTimeline

    Place = float | Callable[[Timeline], float]

FAILS_WITHIN = 1.5  # [s]; a viewer that cannot open a window ends within this time
POSTER = 1 / 3  # of the run's time, default time of a picture; poses at the ends are often singular
_VIEWERS: list[subprocess.Popen[bytes]] = []  # kept, because Python warns of running processes without a reference


def review(
    run: str | Path,
    other: str | Path | None = None,
    *,
    save: str | Path | None = None,
    screenshot: str | Path | None = None,
    at: Place | None = None,
    report: Callable[[str], None] | None = None,
) -> Path | None:
    """Make the recording of a run and open the viewer on it, or only `save` it, or take a `screenshot`.

    Args:
        run: An .mcap file, or an .rrd file to be shown unchanged; or a folder of .rrd files, such as those of the
            designs of a study, to be compared as a dataset.
        other: A second .mcap file to compare with. Default: none.
        save: The .rrd file to write. Default: in the folder of the run, with its name and the suffix .rrd.
        screenshot: The .png file to write. Default: none.
        at: Time of the screenshot [s]; of a run over driver values the value [rad or the unit of length] or the number
            of the sample; or a function that returns it from the timeline of the recording. Default: a third of the
            run.
        report: Called with a line on the common coordinates if the two runs do not have the same. Default: none.

    Returns:
        The path of the recording; None of a folder, and if only a screenshot was taken.

    Raises:
        RequestError: Invalid files or time.
        LogError: A run cannot be read, a file cannot be written, or the viewer cannot open or draw.
        MissingPackageError: The viewer is not installed.

    """
    run = Path(run)
    if run.is_dir():
        _review_dataset(run, other or save or at, screenshot)
        return None
    _check(run, other, save, screenshot, at)
    require_viewer(f"{run}: a review")
    moment: Cursor | CursorOn | None
    if not save and not screenshot:
        _need_display(run)
    if screenshot and not save:
        with temporary_folder() as folder:
            recording, moment = run, _on_shown(at)
            if suffix_of(run) == ".mcap":
                recording = folder / f"{run.stem}.rrd"
                try:
                    moment = _record(run, other, recording, at, report)
                except LogError as error:  # under the user's file name
                    raise LogError(str(error).replace(str(recording), str(screenshot)), **error.data) from None
            _shoot([recording], screenshot, moment)
        return None
    if suffix_of(run) == ".rrd":
        recording, moment = run, _on_shown(at)
    else:
        recording = Path(save) if save else run.with_name(_default_path(run, other))
        moment = _record(run, other, recording, at, report)
    if screenshot:
        _shoot([recording], screenshot, moment)
    elif not save:
        _open(recording)
    return recording


def _review_dataset(folder: Path, other: object, screenshot: str | Path | None) -> None:
    """Open the viewer on the recordings of a folder, or take a picture of their table."""
    recordings = sorted(folder.glob("*.rrd"))
    if other is not None:
        raise RequestError(f"{folder}: a folder of recordings is shown as it is; only a screenshot can be asked for")
    if len(recordings) < 2:
        raise RequestError(f"{folder}: holds {len(recordings)} recordings (.rrd); a dataset has two or more")
    require_viewer(f"{folder}: a review")
    if screenshot:
        if suffix_of(screenshot) != ".png":
            raise RequestError(f"{screenshot}: the name must end in .png")
        _shoot(recordings, screenshot, None)
        return
    _need_display(folder)
    _open(*recordings)


def _check(
    run: Path, other: str | Path | None, save: str | Path | None, screenshot: str | Path | None, at: Place | None
) -> None:
    """Raise a RequestError for files that cannot be reviewed, written or combined."""
    if at is not None and not screenshot:
        asked = "at" if callable(at) else f"at = {at:g}"
        raise RequestError(f"{asked} is the time of a screenshot, and none is asked for")
    for path in (run, *([Path(other)] if other else [])):
        if suffix_of(path) not in (".mcap", ".rrd"):
            raise RequestError(f"{path}: a run to review is an .mcap or .rrd file")
        if not path.is_file():
            raise RequestError(f"{path}: there is no such file")
    if suffix_of(run) == ".rrd" and (other or save):
        what = "compared" if other else "saved as another"
        raise RequestError(f"{run}: a recording cannot be {what}; give the run's .mcap file")
    if other and suffix_of(other) == ".rrd":
        raise RequestError(f"{other}: a recording cannot be compared; give the run's .mcap file")
    for target, suffix in ((save, ".rrd"), (screenshot, ".png")):
        if target and suffix_of(target) != suffix:
            raise RequestError(f"{target}: the name must end in {suffix}")


def _default_path(run: Path, other: str | Path | None) -> str:
    return f"{run.stem}-{Path(other).stem}.rrd" if other else f"{run.stem}.rrd"


def _record(
    run: Path,
    other: str | Path | None,
    recording: Path,
    at: Place | None,
    report: Callable[[str], None] | None,
) -> Cursor | None:
    """Write the recording and return the cursor for a picture of it."""
    first = read(run)
    axis = axis_of(first)
    second = None if other is None else read(other)
    timeline = timeline_of([first] if second is None else [first, second])
    at = at(timeline) if callable(at) else at
    if at is not None and other is None and len(first):
        value = at / axis.factor
        if not min(axis.values[[0, -1]]) <= value <= max(axis.values[[0, -1]]):
            asked = f"at = {at:g} s" if axis.is_time else f"at {axis.name} = {value:.6g} {axis.unit}".rstrip()
            raise RequestError(f"{asked} is outside the run, {axis.range()}")
    if other is None or second is None:
        write_rrd(first, recording)
    else:
        from kinfmu.log.viewer.comparison import in_common, write_comparison

        names = (run.name, Path(other).name)
        write_comparison(first, second, recording, names)
        if report and (line := in_common(first, second, names)):
            report(line)
    placed = timeline.placed(first)
    times = placed.t[first.good] if first.good.any() else placed.t
    if at is not None:
        return timeline.cursor(timeline.place(at))
    return timeline.cursor(float(times[int(POSTER * (len(times) - 1))])) if len(times) else None


def _on_shown(at: Place | None) -> CursorOn | None:
    """Return a function from the viewer's timeline to the cursor of a picture; None without a time."""
    if at is None:
        return None

    def cursor(shown: ShownTimeline) -> Cursor:
        timeline = timeline_named(shown.name)
        place = timeline.place(at(timeline) if callable(at) else at)
        whole = 1e9 if timeline.parts is None else 1.0  # the viewer counts time in nanoseconds
        if shown.start is not None and shown.end is not None and not shown.start <= round(place * whole) <= shown.end:
            per_unit = whole * (timeline.parts or 1)
            span = f"{shown.start / per_unit:.6g} to {shown.end / per_unit:.6g}"
            asked = f"{place / (timeline.parts or 1):.6g}"
            raise RequestError(f"at = {asked} is outside the recording, {timeline.label} = {span}")
        return timeline.cursor(place)

    return cursor


def _shoot(recordings: Sequence[Path], screenshot: str | Path, at: Cursor | CursorOn | None) -> None:
    """Write a picture of the recording, or of the table of several; LogError for a view that cannot show its data."""
    shot = shoot(recordings if len(recordings) > 1 else recordings[0], at)
    with replacing(screenshot) as temporary:
        temporary.write_bytes(shot.png)
    if shot.reports:
        raise LogError(f"{screenshot}: the viewer reports: {'; '.join(shot.reports)}")


def _need_display(run: Path) -> None:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise LogError(
            f"{run}: there is no display to open the viewer on; save a recording for another machine (--save F.rrd) "
            "or take a picture (--screenshot F.png)"
        )


def _open(*recordings: Path) -> None:
    """Start the viewer and leave it running; a viewer that is already open shows the recordings instead."""
    with TemporaryFile() as complaints:
        viewer = subprocess.Popen(  # noqa: S603  # our own arguments
            [executable(), "--bind", "127.0.0.1", *(str(recording.resolve()) for recording in recordings)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            start_new_session=True,
        )
        try:
            code = viewer.wait(FAILS_WITHIN)
        except subprocess.TimeoutExpired:
            _VIEWERS.append(viewer)
            return
        if code:
            raise LogError(f"{recordings[0]}: the viewer could not be opened: {last_error(complaints)}")
