"""What is played: a file that is watched, the page of its last valid content, and what is wrong with it now."""

from __future__ import annotations

import threading
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from kinfmu.analysis import check
from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, RequestError
from kinfmu.files import suffix_of
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery import load
from kinfmu.page.editor import Drawing, Session, sketch
from kinfmu.page.html import editor_script, page_data, page_of

PERIOD = 0.2  # [s] between two looks at the file
_SCRIPT = Path(__file__).with_name("served.js")


class State(NamedTuple):
    """What a page shows of its file.

    Attributes:
        change: Counts the changes of this state.
        version: Counts the pages.
        problem: Why the file has no newer page; empty if it is the page of the file as it is.
        is_busy: True while the page of a changed file is being made.
        editor: Number of the current state of the drawing; 0 before it is edited.

    """

    change: int
    version: int
    problem: str
    is_busy: bool = False
    editor: int = 0


class PlaySource:
    """A mechanism and its page, made again when its file changes.

    Args:
        name: A name of the gallery, which is not watched, or a mechanism file (.toml). A file that is drawn in part
            only has a page in which it can be drawn further.
        is_new: True for a file that is not there yet: an empty drawing.

    Raises:
        KinfmuError: The mechanism is invalid, or one of the gallery that cannot be solved.
        RequestError: It is too large for a page; or a new file is there already.

    """

    def __init__(self, name: str, *, is_new: bool = False) -> None:
        self.path = Path(name) if suffix_of(name) == ".toml" else None
        self._session: Session | None = None
        self._making_session = threading.Lock()
        if is_new:
            self._check_new(name)
        self._name = name
        self._news = threading.Condition()
        self._closed = threading.Event()
        self._stamp = self._seen = self._stamped()
        self._state = State(1, 1, "")
        self._reported: tuple[object, object] | None = None
        self.mechanism, self._page = self._made(may_be_partial=True)

    def _check_new(self, name: str) -> None:
        if self.path is None:
            raise RequestError(f"'{name}' must end in .toml: kinfmu play --new {name}.toml")
        if self.path.exists():
            raise RequestError(f"{name} is there already; kinfmu play {name} opens it")
        if not self.path.absolute().parent.is_dir():
            raise RequestError(f"{name}: there is no folder {self.path.parent}")
        self._session = Session(self.path)

    @property
    def folder(self) -> Path:
        """Where files are saved: the folder of the mechanism file, or the current one."""
        return self.path.parent if self.path else Path()

    @property
    def state(self) -> State:
        """The state now."""
        return self._state

    def session(self) -> Session:
        """Return the states of the drawing, which begin when they are first asked for.

        Raises:
            RequestError: A mechanism of the gallery is played, which has no file of the user.
            KinfmuError: The file or the folder of the states cannot be used.

        """
        if self.path is None:
            raise RequestError("only a mechanism file can be edited; save one from this page, and open it")
        with self._making_session:
            if self._session is None:
                self._session = Session(self.path)
        return self._session

    def report_states(self) -> None:
        """Report the current state of the drawing to all pages."""
        if self._session is None:
            return
        self._reported = self._session.stamp(), self._stamp
        try:
            number = self._session.current()[0]
        except KinfmuError:
            return  # requests report it
        with self._news:
            if number != self._state.editor:
                self._state = self._state._replace(change=self._state.change + 1, editor=number)
                self._news.notify_all()

    def page(self) -> str:
        """Return the page of the last valid content of the file; it knows its version."""
        with self._news:
            return self._page.replace("<html", f'<html data-version="{self._state.version}"', 1)

    @property
    def is_closed(self) -> bool:
        """True after `close`."""
        return self._closed.is_set()

    def close(self) -> None:
        """End all watching and waiting."""
        with self._news:
            self._closed.set()
            self._news.notify_all()
        if self._session is not None:
            with suppress(KinfmuError):
                self._session.close()

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
            mechanism, text = self._made(may_be_partial=self._session is not None)
        except KinfmuError as error:
            self._tell(problem=str(error))
        else:
            self._tell(mechanism, text)

    def watch(self) -> None:
        """Look at the file until `close`; what is in the gallery does not change."""
        while self.path and not self._closed.wait(PERIOD):
            self.look()
            if self._session is not None and (self._session.stamp(), self._stamp) != self._reported:
                self.report_states()  # of another program

    def _tell(
        self, mechanism: Mechanism | None = None, text: str = "", problem: str = "", *, is_busy: bool = False
    ) -> None:
        with self._news:
            change, version, _, _, editor = self._state
            if mechanism is not None and text != self._page:
                self.mechanism, self._page = mechanism, text
                version += 1
            self._state = State(change + 1, version, problem, is_busy, editor)
            self._news.notify_all()

    def _stamped(self) -> tuple[int, int, int] | None:
        """Return what changes when the file is written or replaced; None without a file."""
        try:
            found = self.path.stat() if self.path else None
        except OSError:
            return None
        return found and (found.st_mtime_ns, found.st_size, found.st_ino)

    def _made(self, *, may_be_partial: bool) -> tuple[Mechanism, str]:
        """Return the mechanism and its page; may_be_partial: also of a file that is drawn in part only."""
        try:
            mechanism = load(self._name)
        except KinfmuError as problem:
            return self._partial(problem, may_be_partial=may_be_partial)
        try:
            report = check(mechanism)
            if report.problem is not None and report.plan is None:
                raise report.problem
            data = page_data(mechanism, report)
        except (RequestError, MechanismError, AssemblyError) as error:
            named = type(error)(f"{self._name}: {error}", **error.data)
            if isinstance(error, RequestError):
                raise named from None
            return self._partial(named, may_be_partial=may_be_partial)
        return mechanism, self._page_of(data)

    def _partial(self, problem: KinfmuError, *, may_be_partial: bool) -> tuple[Mechanism, str]:
        """Return the mechanism and the page of a drawing; the problem is raised if it is none."""
        if not may_be_partial or self.path is None:
            raise problem
        try:
            drawing = self.session().current()[1] if self._session else Drawing.read(self.path)
        except KinfmuError:
            raise problem from None
        return drawing.mechanism, self._page_of(sketch(drawing))

    def _page_of(self, data: dict[str, Any]) -> str:
        is_editable = self.path is not None
        script = (editor_script() if is_editable else "") + _SCRIPT.read_text("utf-8")
        return page_of(data | {"isEditable": is_editable}, script)
