"""Rerun recording: the picture of a run, with its blueprint inside.

    /linkage/...        of a system with several mechanisms /linkage/<component>/..., each in a view of its own
    /linkage/...        bodies with what joints add to them, pins, bars, cylinders, supports, rails; y up
    /linkage/paths/...  paths of points of interest over the run; /linkage/trails/...: over the last moments
    /position/angle     and /position/length, /velocity/..., /acceleration/...: one entity for each kind of quantity,
                        one curve a coordinate, in deg and the mechanism's unit of length
    /forces/torque      efforts of drivers, with /forces/force, /forces/power, /forces/energy [N m, N, W, J]
    /reactions/force    sizes of the forces of joints; /reactions/torque: moments; with shaking force and moment
    /signals/0          outputs of FMUs that are not kinfmu's, an entity for each unit
    /linkage/forces     arrows of the forces that joints transmit, with a legend
    /solver/accuracy    log10 of residual and watches; /solver/error: of the estimated errors; /solver/margin
    /solver/iterations  of Newton's method
    /solver/status      a lane of states
    /log                changes of status and events
    /card               mechanism, run and verdict

The viewer keeps one blueprint per application and ignores the blueprint of a second recording. So runs of the same
mechanism and time, which need the same blueprint, belong to one application: a layout that you arrange for one is kept
for the next. Other runs belong to another application.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4
from zlib import crc32

import numpy as np

from kinfmu.draw.scene import palette
from kinfmu.draw.scene.completed import component_runs
from kinfmu.draw.scene.scene import drawable
from kinfmu.errors import LogError
from kinfmu.files import temporary_folder
from kinfmu.log.cdr import check_times
from kinfmu.log.target import replacing
from kinfmu.log.viewer.blueprint import Drawn, is_ok, single
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.linkage import APPLICATION, Linkage
from kinfmu.log.viewer.marks import log_arrows, log_loads
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.series import (
    Group,
    accuracy,
    efforts,
    error_estimates,
    groups,
    iterations,
    margin,
    reactions,
    signals,
)
from kinfmu.log.viewer.timeline import Timeline, decimated, send, timeline_of
from kinfmu.run import Run
from kinfmu.run.components import is_of_mechanisms
from kinfmu.run.verdict import changes, label, notable_events, sentence
from kinfmu.solver.python.pose import Status

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}

_ENCODING = "Failed to encode LogMsg: "  # beginning of Rerun's messages


def write_rrd(run: Run, path: str | Path) -> None:
    """Write `run` as a Rerun recording with the blueprint to review it.

    A run of more than decimated.MOST_ROWS samples is decimated; peaks and gaps are kept, and the card states the
    numbers. The lane of states and the log are made from all samples.

    Args:
        run: The run.
        path: The .rrd file; an older one is replaced when the new one is complete.

    Raises:
        LogError: The file cannot be written, or a time is outside the range of a log.
        MissingPackageError: The viewer is not installed.

    """
    require_viewer(f"{path}: a recording")
    check_times(run.t)  # reports invalid times before a file is made
    content = content_of(run, timeline_of([run]))
    name = run.info.get("title") or run.info.get("name") or Path(path).stem
    application_id = application([content.shown], [*content.curves.values(), *content.forces])
    with recording(path, name, content.layout(), application_id) as rec:
        content.log(rec)


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """What the recording of a run holds.

    shown: its samples on the timeline, fewer of long runs; note: what is not drawn; curves, forces, solver: groups.
    """

    run: Run
    timeline: Timeline
    shown: Run
    drawn: Sequence[Drawn]
    note: str
    curves: Mapping[tuple[str, str], Group]
    forces: Sequence[Group]
    solver: Sequence[Group]

    def log(self, rec: rr.RecordingStream) -> None:
        """Log all of it."""
        rec.send_property("kinfmu", _properties(self.run))
        for one in self.drawn:
            if one.scene:
                linkage = Linkage(rec, one.root, self.timeline, one.run, one.scene)
                linkage.log()
                log_loads(linkage, log_arrows(linkage, one.arrows))
        for group in (*self.curves.values(), *self.forces, *self.solver):
            log_group(rec, "", self.timeline, self.shown, group)
        log_status(rec, "", self.timeline, self.timeline.placed(self.run))
        self.log_card(rec)

    def log_card(self, rec: rr.RecordingStream) -> None:
        """Log the card alone."""
        note = " ".join([*left_out(self.run, self.shown), self.note]).strip()
        log_card(rec, card(self.run, note, [*self.curves.values(), *self.forces]))

    def layout(self) -> rrb.Blueprint:
        """Return the layout of this run."""
        return single(self.timeline, self.shown, self.drawn, self.curves, self.forces, self.solver)


def content_of(run: Run, timeline: Timeline) -> RecordedRun:
    """Return what the recording of a run holds."""
    shown = timeline.placed(decimated(run))
    drawn, note = drawn_linkages(shown)
    solver = [group for group in (accuracy(shown), error_estimates(shown), margin(shown), iterations(shown)) if group]
    forces = [*efforts(shown), *reactions(shown), *signals(shown)]
    return RecordedRun(run, timeline, shown, drawn, note, groups(shown), forces, solver)


def drawn_linkages(run: Run) -> tuple[list[Drawn], str]:
    """Return the linkages of a run, one for each mechanism of a system, and a sentence on what cannot be drawn."""
    import rerun as rr

    parts = component_runs(run)
    if not parts:
        if not (run.outputs or run.mechanism_text):
            return [], ""
        scene, note = drawable(run)
        return [Drawn("linkage", "/linkage", run, scene)], note
    found, notes = [], []
    for name, part in parts.items():
        scene, note = drawable(part)
        found.append(Drawn(name, f"/linkage/{rr.escape_entity_path_part(name)}", part, scene))
        notes += [f"{name}: {note}"] if note else []
    return found, " ".join(notes)


def left_out(run: Run, shown: Run) -> list[str]:
    """Return a sentence on the samples that the recording leaves out; empty if it holds all."""
    if len(shown) == len(run):
        return []
    return [f"{len(shown)} of {len(run)} samples are drawn, peaks and gaps among them; the MCAP holds all."]


def application(runs: Sequence[Run], groups: Iterable[Group]) -> str:
    """Return Rerun's application id for such runs and curves, such as 'kinfmu_fourbar_12ab34cd'.

    The viewer keeps one layout per application, so recordings that need another layout get another id.
    """
    ranges = [(group.path, group.extent, group.is_constant) for group in groups]
    spans = [(float(run.t.min()), float(run.t.max())) for run in runs if len(run)]
    facts = repr(
        (
            spans,
            ranges,
            [(run.mechanism_text, run.outputs, run.axis, bool(notable_events(run)), is_ok(run)) for run in runs],
        )
    )
    parts = [name for run in runs for name in component_runs(run)]
    facts += repr(parts) if parts else ""  # each has a view
    names = [re.sub("[^a-z0-9]+", "_", run.info.get("name", "run").lower()) for run in runs]
    return "_".join([APPLICATION, *dict.fromkeys(names), f"{crc32(facts.encode()):08x}"])


@contextmanager
def recording(
    path: str | Path, name: str, layout: rrb.Blueprint, application: str, identifier: str = ""
) -> Iterator[rr.RecordingStream]:
    """Yield a recording; its complete file replaces `path` when the block ends.

    identifier: of the recording. Default: one that no other has.
    """
    import rerun as rr

    with replacing(path) as temporary, _path_in_utf8(temporary) as saved:
        rec = rr.RecordingStream(application, recording_id=identifier or f"{_in_utf8(Path(path).stem)}-{uuid4()}")
        rec.set_log_time_enabled(False)  # wall-clock time is not needed and takes 16 bytes a row
        rec.set_log_tick_enabled(False)
        try:
            rec.save(saved, default_blueprint=layout)
        except RuntimeError as error:  # Rerun's form of an OSError
            raise LogError(f"{path}: cannot be written ({str(error).removeprefix(_ENCODING)})") from error
        rec.send_recording_name(_in_utf8(name))
        try:
            yield rec
            _flush(rec, path)
        finally:
            rec.disconnect()  # writes the footer
        _check_whole(temporary, path)


def log_group(
    rec: rr.RecordingStream, root: str, timeline: Timeline, run: Run, group: Group, width: float | None = None
) -> None:
    """Log the curves of a group: lines with gaps where they are NaN, or points if a sample lies between two gaps.

    width: of all lines [points]. Default: that of `Group.widths`.
    """
    import rerun as rr

    path = f"{root}/{group.path}"
    names, colours = list(group.names), list(group.colours)
    look: rr.SeriesPoints | rr.SeriesLines
    if group.is_scattered:
        look = rr.SeriesPoints(names=names, colors=colours, marker_sizes=[2.5] * len(names))
    else:
        look = rr.SeriesLines(
            names=names,
            colors=colours,
            widths=group.widths() if width is None else [width] * len(names),
            interpolation_mode="StepAfter" if group.is_stepped else "Linear",
        )
    rec.log(path, look, static=True)
    values = group.values
    send(rec, path, timeline, run.t, lambda rows: rr.Scalars.columns(scalars=np.ascontiguousarray(values[rows])))


def log_card(rec: rr.RecordingStream, markdown: str) -> None:
    """Log the card."""
    import rerun as rr

    rec.log("/card", rr.TextDocument(_in_utf8(markdown), media_type="text/markdown"), static=True)


def log_status(rec: rr.RecordingStream, root: str, timeline: Timeline, run: Run) -> None:
    """Log the lane of states and the events."""
    import rerun as rr

    path = f"{root}/solver/status"
    labels = [label(status) for status in Status]
    colours = [palette.STATUS[status] for status in Status]
    rec.log(path, rr.StateConfiguration(values=labels, colors=colours), static=True)
    changed = list(changes(run))
    times = np.array([change.t for change in changed])
    states = [label(change.status) for change in changed]
    send(rec, path, timeline, times, lambda rows: rr.StateChange.columns(state=states[rows]))
    events = notable_events(run)
    send(
        rec,
        f"{root}/log",
        timeline,
        np.array([event.t for event in events]),
        lambda rows: rr.TextLog.columns(
            text=[event.text for event in events[rows]],
            level=[_LEVELS.get(event.level, "INFO") for event in events[rows]],
        ),
    )


def _properties(run: Run) -> rr.AnyValues:
    """Return the run's info, unit and verdict as properties of the recording."""
    import rerun as rr

    about = rr.AnyValues()
    info = {key: text for key, text in run.info.items() if not is_of_mechanisms(key)}
    for name, text in {**info, "length_unit": run.length_unit, "verdict": sentence(run)}.items():
        about.with_component_from_data(name, text)
    return about


def _in_utf8(name: str) -> str:
    """Return the name of a file with a question mark for each byte that is not UTF-8."""
    return name.encode(errors="replace").decode()


@contextmanager
def _path_in_utf8(file: Path) -> Iterator[Path]:
    """Yield a path of a file that is UTF-8, which Rerun requires: a link to the file if its own path is not."""
    if _in_utf8(str(file)) == str(file):
        yield file
        return
    with temporary_folder() as folder:
        link = folder / "run.rrd"
        link.symlink_to(file.absolute())
        yield link


def _flush(rec: rr.RecordingStream, path: str | Path) -> None:
    try:
        rec.flush()
    except RuntimeError as error:
        raise LogError(f"{path}: the recording could not be written to its end ({error}); is the disk full?") from error


def _check_whole(file: Path, path: str | Path) -> None:
    """Look for the footer, because Rerun reports failures after the last flush on the terminal only."""
    with file.open("rb") as stream:
        stream.seek(-min(64, file.stat().st_size), 2)
        if b"RRF" not in stream.read():
            raise LogError(f"{path}: the recording could not be written to its end; is the disk full?")
