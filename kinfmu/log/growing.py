"""An MCAP file that grows with its run: what was added is in the file, even if the process is killed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from shlex import quote

from kinfmu.files import lock_for_writing
from kinfmu.log.cdr import zero_of
from kinfmu.log.target import check_writable, replacing, target_of, write_error
from kinfmu.log.writing import Content
from kinfmu.run import Event, Run
from kinfmu.run.verdict import status_events, unexplained
from kinfmu.solver.python.pose import Status


class McapLog:
    """A sink for `simulate` that writes the MCAP file of `write_mcap`, one chunk for each piece of the run.

    What viewers draw is chosen and written when the run has ended, and by `recover`.

    The file replaces an older one of this name when the first samples are written. The name is locked until the run
    ends. If the process is killed, the file holds what was added; `recover` makes a complete file of it. If the file
    cannot be written any more, what was written stays, and the LogError states up to which time.

    Args:
        path: The file to write.
        drawn: True (default) to add the topics that ROS 2 viewers draw.

    """

    def __init__(self, path: str | Path, *, drawn: bool = True) -> None:
        self.path = Path(path)
        self._drawn = drawn
        self._content: Content | None = None
        self._file: FileIO | None = None
        self._status = Status.OK  # of the last sample in the file
        self._held: list[Event] = []  # failures whose reason may be in the next piece

    def begin(self, run: Run) -> None:  # noqa: ARG002  # every piece of the run holds what is in this one
        """Begin a run.

        Args:
            run: The run before its first sample.

        Raises:
            LogError: The file cannot be made, or another run is being written to it.

        """
        check_writable(self.path)
        self._content, self._status, self._held = None, Status.OK, []

    def add(self, run: Run) -> None:
        """Write the next samples, and the events since the last call.

        Args:
            run: These samples and events only.

        Raises:
            LogError: The file cannot be written.

        """
        if self._content is None:
            self._start(run)
        else:
            with self._whole_records():
                self._put(self._content, run)

    def end(self, run: Run, reason: str) -> None:
        """Finish the file.

        Args:
            run: The whole run.
            reason: Why it ended early, if none of its events states that; else empty.

        Raises:
            LogError: The file cannot be written.

        """
        if self._content is None:
            self._start(run)
        if self._content and self._file:
            with self._whole_records():
                self._content.log(self._held, ())
                self._content.end(run, reason)
        self.close()

    def close(self) -> None:
        """Close the file as it is; `end` does this too."""
        if self._file:
            self._file.close()

    def _start(self, run: Run) -> None:
        """Make the file with its first samples; a failure leaves an older file unchanged."""
        file: FileIO | None = None
        try:
            with replacing(self.path) as temporary:
                file = FileIO(temporary, "w")
                lock_for_writing(file.fileno())
                content = Content(file, run, zero_of(run.t), drawn=self._drawn, at_once=True)
                self._put(content, run)
                if sys.platform == "win32":  # an open file cannot be renamed there
                    file.close()
        except BaseException:
            if file:
                file.close()
            raise
        if file.closed:
            file = FileIO(target_of(self.path), "a")
            content.continue_in(file)
        self._file, self._content = file, content

    def _put(self, content: Content, run: Run) -> None:
        content.add(run)
        due = unexplained(self._held, run.events)
        new = unexplained(status_events(run, self._status), run.events)
        self._held = [change for change in new if change.level == "error"]
        content.log([*due, *(change for change in new if change.level != "error")], run.events)
        if len(run):
            self._status = Status(int(run.status[-1]))

    @contextmanager
    def _whole_records(self) -> Iterator[None]:
        """If writing fails in this block, cut the file after its last complete record."""
        try:
            yield
        except OSError as error:
            if not (self._content and self._file):
                raise
            with suppress(OSError):
                self._file.truncate(self._content.length)
            self.close()
            kept = f"; it holds the run up to t = {self._content.until:g} s: kinfmu recover {quote(str(self.path))}"
            raise write_error(self.path, error, kept) from error
