"""An MCAP file that grows with its run: what was added is there, whatever happens to the process."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from shlex import quote

from kinfmu.files.whole_file import lock_for_writing
from kinfmu.log.clock import zero_of
from kinfmu.log.mcap_file import Content
from kinfmu.log.target import check_room, checked, replacing, unwritable
from kinfmu.log.verdict import status_events, unexplained
from kinfmu.run import Event, Run
from kinfmu.solver.python.status import Status


class McapLog:
    """A sink for `simulate`: an MCAP file as `write_mcap` writes it, with a chunk in it for every piece of the run.

    drawn: with the topics that viewers of ROS 2 draw. The file takes the place of an older one with its first samples.
    Until its end no other run takes this name. Of a run that was killed it holds what was added; `recover` makes a
    whole file of it. When it can no longer be
    written, what was written stays, and the LogError says up to when.
    """

    def __init__(self, path: str | Path, *, drawn: bool = True) -> None:
        self.path = Path(path)
        self._drawn = drawn
        self._content: Content | None = None
        self._file: FileIO | None = None
        self._status = Status.OK  # of the last sample in the file
        self._held: list[Event] = []  # failures that the next piece may tell the reason of

    def begin(self, run: Run) -> None:  # noqa: ARG002  # every piece of the run holds what is in this one
        """The run before its first sample; LogError if no file can be made."""
        check_room(self.path)
        self._content, self._status, self._held = None, Status.OK, []

    def add(self, run: Run) -> None:
        """The next samples, and the events since the last call."""
        if self._content is None:
            self._start(run)
        else:
            with self._kept_if_it_fails():
                self._put(self._content, run)

    def end(self, run: Run, reason: str) -> None:
        """The whole run; reason: why it ended early, if none of its events says so."""
        if self._content is None:
            self._start(run)
        if self._content and self._file:
            with self._kept_if_it_fails():
                self._content.log(self._held, ())
                self._content.end(run, reason)
        self.close()

    def close(self) -> None:
        """Leave the file as it is: `end` does so, and who gives up before."""
        if self._file:
            self._file.close()

    def _start(self, run: Run) -> None:
        """The file with its first samples: whatever fails here leaves an older file as it was."""
        file: FileIO | None = None
        try:
            with replacing(self.path) as temporary:
                file = FileIO(temporary, "w")
                lock_for_writing(file.fileno())
                content = Content(file, run, zero_of(run.t), drawn=self._drawn, at_once=True)
                self._put(content, run)
                if sys.platform == "win32":  # where an open file cannot be renamed
                    file.close()
        except BaseException:
            if file:
                file.close()
            raise
        if file.closed:
            file = FileIO(checked(self.path), "a")
            content.go_on_in(file)
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
    def _kept_if_it_fails(self) -> Iterator[None]:
        """What fails in this block leaves whole records in the file."""
        try:
            yield
        except OSError as error:
            if not (self._content and self._file):
                raise
            with suppress(OSError):
                self._file.truncate(self._content.length)
            self.close()
            kept = f"; it holds the run up to t = {self._content.until:g} s: kinfmu recover {quote(str(self.path))}"
            raise unwritable(self.path, error, kept) from error
