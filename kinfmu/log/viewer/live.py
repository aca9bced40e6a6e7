"""A run in the Rerun viewer while it is computed: each piece of the run is sent as soon as it is there.

The viewer is one of this machine: a connection to its loopback interface. The layout follows the newest sample; when
the run ends, the layout of `write_rrd` takes its place, with the paths of all samples and the card.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from contextlib import suppress
from tempfile import TemporaryFile
from typing import TYPE_CHECKING
from uuid import uuid4

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError
from kinfmu.log.cdr import check_times
from kinfmu.log.viewer.blueprint import Drawn
from kinfmu.log.viewer.headless import executable, last_error
from kinfmu.log.viewer.linkage import APPLICATION, Linkage
from kinfmu.log.viewer.marks import FORCES, log_arrows, log_loads
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.rerun_file import content_of, drawn_linkages, log_group, log_status
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
from kinfmu.log.viewer.timeline import decimated, timeline_of
from kinfmu.run import Run

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

PORT = 9876  # that of the viewer
ANSWER_TIME = 5.0  # [s], at most, until the viewer has received a piece
START_TIME = 30.0  # [s], at most, until a new viewer answers
_POLL = 0.05  # [s]
_VIEWERS: list[subprocess.Popen[bytes]] = []  # kept, because Python warns of running processes without a reference


class LiveView:
    """A sink for `simulate` that shows the run in the Rerun viewer while it is computed.

    A viewer that is closed meanwhile ends the live view, but not the run.

    Args:
        stream: The recording stream to send to, such as one that is connected to a viewer of another machine. Default:
            a stream to the viewer of this machine, which is opened if none is open.

    Raises:
        LogError: There is no display to open a viewer on, or it does not open.
        MissingPackageError: The viewer is not installed.

    """

    def __init__(self, stream: rr.RecordingStream | None = None) -> None:
        require_viewer("the live view")
        self._stream = _stream_to_viewer() if stream is None else stream
        self._paths: dict[str, dict[str, list[FloatArray]]] = {}  # by linkage and path
        self._has_layout = False
        self._is_connected = True

    def begin(self, run: Run) -> None:
        """Begin a run.

        Args:
            run: The run before its first sample.

        """
        self._paths, self._has_layout = {}, False
        self._stream.send_recording_name(run.info.get("title") or run.info.get("name") or "run")

    def add(self, run: Run) -> None:
        """Show the next samples, and the events since the last call.

        Args:
            run: These samples and events only.

        Raises:
            LogError: A time is outside the range of a log.

        """
        if not len(run) or not self._is_connected:
            return
        check_times(run.t)
        timeline = timeline_of([run])
        shown = timeline.placed(decimated(run))
        drawn, _ = drawn_linkages(shown)
        curves, diagnostics = _groups(shown)
        if not self._has_layout:
            self._stream.send_blueprint(
                _following([*curves, *diagnostics], timeline.name, [one for one in drawn if one.scene])
            )
            self._has_layout = True
        for one in drawn:
            if one.scene:
                linkage = Linkage(self._stream, one.root, timeline, one.run, one.scene)
                linkage.log()
                log_loads(linkage, [load.name for load in one.scene.shapes if load.kind in FORCES])
                paths = self._paths.setdefault(one.root, {})
                for name, points in one.scene.paths.items():
                    paths.setdefault(name, []).append(points)
                linkage.log_paths({name: np.vstack(parts) for name, parts in paths.items()})
        for group in (*curves, *diagnostics):
            log_group(self._stream, "", timeline, shown, group)
        log_status(self._stream, "", timeline, timeline.placed(run))
        self._flush()

    def end(self, run: Run, reason: str) -> None:  # noqa: ARG002  the card has the events and the verdict
        """Show the layout of the whole run, its card, reactions, and arrows of forces to the scale of the whole run.

        Args:
            run: The whole run.
            reason: Why it ended early, if none of its events states that; else empty.

        """
        if not self._is_connected:
            return
        content = content_of(run, timeline_of([run]))
        for one in content.drawn:
            if one.scene:
                linkage = Linkage(self._stream, one.root, content.timeline, one.run, one.scene)
                linkage.log_paths(one.scene.paths)
                log_loads(linkage, log_arrows(linkage, one.arrows))
        for group in reactions(content.shown):
            log_group(self._stream, "", content.timeline, content.shown, group)
        content.log_card(self._stream)
        self._stream.send_blueprint(content.layout())
        self._flush()

    def _flush(self) -> None:
        """Wait until the viewer has what was sent; one that was closed ends the live view, but not the run."""
        try:
            self._stream.flush(timeout_sec=ANSWER_TIME)
        except RuntimeError:
            self._is_connected = False


def _groups(run: Run) -> tuple[list[Group], list[Group]]:
    """Return the curves of a run, and the diagnostics of the solver."""
    solver = (accuracy(run), error_estimates(run), margin(run), iterations(run))
    return [*groups(run).values(), *efforts(run), *signals(run)], [group for group in solver if group]


def _following(shown: list[Group], timeline: str, drawn: list[Drawn]) -> rrb.Blueprint:
    """Return a layout whose axes fit what is there so far, and whose cursor follows the newest sample."""
    import rerun.blueprint as rrb

    plots = [rrb.TimeSeriesView(origin=f"/{group.path}", name=group.title) for group in shown]
    linkages = [rrb.Spatial2DView(origin=one.root, name=one.title) for one in drawn]
    return rrb.Blueprint(
        rrb.Horizontal(*linkages, rrb.Grid(*plots)),
        rrb.TimePanel(timeline=timeline, play_state="following"),
        collapse_panels=True,
    )


def _stream_to_viewer() -> rr.RecordingStream:
    """Return a stream to the open viewer of this machine, or to a new one."""
    import rerun as rr

    if not _answers():
        _open_viewer()
    stream = rr.RecordingStream(f"{APPLICATION}_live", recording_id=str(uuid4()))
    stream.set_log_time_enabled(False)  # wall-clock time is not needed
    stream.set_log_tick_enabled(False)
    stream.connect_grpc(f"rerun+http://127.0.0.1:{PORT}/proxy")
    return stream


def _answers() -> bool:
    """Return True if a viewer listens on the loopback interface."""
    with suppress(OSError), socket.create_connection(("127.0.0.1", PORT), timeout=0.5):
        return True
    return False


def _open_viewer() -> None:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise LogError(
            "there is no display to open the viewer on; simulate without the live view, and then take a picture of the "
            "record: kinfmu review RUN.mcap --screenshot F.png"
        )
    with TemporaryFile() as complaints:
        viewer = subprocess.Popen(  # noqa: S603  # our own arguments
            [executable(), "--bind", "127.0.0.1", "--port", str(PORT), "--hide-welcome-screen"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            start_new_session=True,
        )
        _VIEWERS.append(viewer)
        deadline = time.monotonic() + START_TIME
        while not _answers():
            if viewer.poll() is not None:
                raise LogError(f"the viewer could not be opened: {last_error(complaints)}")
            if time.monotonic() > deadline:
                raise LogError(f"the viewer did not open within {START_TIME:.0f} s")
            time.sleep(_POLL)
