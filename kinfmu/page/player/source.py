"""What is played: a file that is watched, the page of its last valid content, and what is wrong with it now."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import NamedTuple

from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, RequestError
from kinfmu.files import suffix_of
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery import load
from kinfmu.page import page

PERIOD = 0.2  # [s] between two looks at the file
_SCRIPT = Path(__file__).with_name("served.js")


class State(NamedTuple):
    """What a page shows of its file.

    Attributes:
        change: Counts the changes of this state.
        version: Counts the pages.
        problem: Why the file has no newer page; empty if it is the page of the file as it is.
        is_busy: True while the page of a changed file is being made.

    """

    change: int
    version: int
    problem: str
    is_busy: bool = False


class PlaySource:
    """A mechanism and its page, made again when its file changes.

    Args:
        name: A name of the gallery, which is not watched, or a mechanism file (.toml).

    Raises:
        KinfmuError: The mechanism is invalid or cannot be solved.
        RequestError: It is too large for a page.

    """

    def __init__(self, name: str) -> None:
        self.path = Path(name) if suffix_of(name) == ".toml" else None
        self._name = name
        self._news = threading.Condition()
        self._closed = threading.Event()
        self._stamp = self._seen = self._stamped()
        self.mechanism = load(name)
        self._page = self._page_of(self.mechanism)
        self._state = State(1, 1, "")

    @property
    def folder(self) -> Path:
        """Where files are saved: the folder of the mechanism file, or the current one."""
        return self.path.parent if self.path else Path()

    @property
    def state(self) -> State:
        """The state now."""
        return self._state

    def page(self) -> str:
        """Return the page of the last valid content of the file; it knows its version."""
        with self._news:
            return self._page.replace("{{served version}}", str(self._state.version))

    @property
    def is_closed(self) -> bool:
        """True after `close`."""
        return self._closed.is_set()

    def close(self) -> None:
        """End all watching and waiting."""
        with self._news:
            self._closed.set()
            self._news.notify_all()

    def wait(self, seen: int, seconds: float) -> State | None:
        """Return the state when it is another than change number `seen`; None if none came in time."""
        with self._news:
            self._news.wait_for(lambda: self.is_closed or self._state.change != seen, seconds)
            return self._state if self._state.change != seen else None

    def look(self) -> None:
        """Read the file again if it changed before the last look and not since: it may be half written."""
        stamp = self._stamped()
        before, self._seen = self._seen, stamp
        if stamp == self._stamp or stamp != before:
            return
        self._stamp = stamp
        self._tell(problem=self._state.problem, is_busy=True)
        try:
            mechanism = load(self._name)
            text = self._page_of(mechanism)
        except KinfmuError as error:
            self._tell(problem=str(error))
        else:
            self._tell(mechanism, text)

    def watch(self) -> None:
        """Look at the file until `close`; what is in the gallery does not change."""
        while self.path and not self._closed.wait(PERIOD):
            self.look()

    def _tell(
        self, mechanism: Mechanism | None = None, text: str = "", problem: str = "", *, is_busy: bool = False
    ) -> None:
        with self._news:
            change, version, *_ = self._state
            if mechanism is not None and text != self._page:
                self.mechanism, self._page = mechanism, text
                version += 1
            self._state = State(change + 1, version, problem, is_busy)
            self._news.notify_all()

    def _stamped(self) -> tuple[int, int, int] | None:
        """Return what changes when the file is written or replaced; None without a file."""
        try:
            found = self.path.stat() if self.path else None
        except OSError:
            return None
        return found and (found.st_mtime_ns, found.st_size, found.st_ino)

    def _page_of(self, mechanism: Mechanism) -> str:
        try:
            return page(mechanism, script=_SCRIPT.read_text("utf-8"))
        except (RequestError, MechanismError, AssemblyError) as error:
            raise type(error)(f"{self._name}: {error}", **error.data) from None
