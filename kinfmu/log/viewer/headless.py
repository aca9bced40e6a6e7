"""A Rerun viewer without a window: pictures of recordings, and the errors and warnings of its views."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any

from kinfmu.errors import LogError

if TYPE_CHECKING:
    from rerun.experimental import Timeline, ViewerClient

Cursor = dict[str, Any]  # {"duration": seconds}, or {"sequence": number} of recordings without time
CursorOn = Callable[["Timeline"], Cursor]  # a function that returns the cursor on the recording's timeline
START_TIME, SETTLE_TIME, END_TIME = 30.0, 25.0, 5.0  # [s], at most
NO_DRIVER = (
    "no graphics driver for a picture without a display; on Debian and Ubuntu this installs one: scripts/graphics (in "
    "the source tree) or apt-get install mesa-vulkan-drivers libvulkan1"
)
_SIGNS_OF_NO_DRIVER = ("No graphics adapter", "render context")  # no driver; a driver that is too old
_COLOUR = re.compile("\x1b\\[[0-9;]*m")  # of terminals
_POLL = 0.05  # [s]
_PROBE_SIZE = 640  # [pixels]; small pictures are enough to detect changes


@dataclass(frozen=True)
class Shot:
    """A picture of a recording: PNG bytes, the names of its views, and their reports as 'view: severity: text'."""

    png: bytes
    views: tuple[str, ...]
    reports: tuple[str, ...]


def shoot(
    path: str | Path | Sequence[Path], at: Cursor | CursorOn | None = None, size: tuple[int, int] = (1600, 900)
) -> Shot:
    """Show a recording in an invisible viewer, at the cursor `at` if given, and return a picture of the settled view.

    Of several recordings, which are a dataset, the picture shows their table.

    A LogError whose data hold `no_graphics` means that the machine has no graphics driver.
    """
    with viewer(size) as shown:
        shown.show(path, at)
        return shown.shot()


class Viewer:
    """An invisible viewer that shows one recording after another."""

    def __init__(self, client: ViewerClient) -> None:
        self._client = client

    def show(self, path: str | Path | Sequence[Path], at: Cursor | CursorOn | None = None) -> None:
        """Show a recording, which replaces the one before, at the cursor `at` if given; of several their table."""
        paths = [path] if isinstance(path, str | Path) else path
        client, deadline = self._client, time.monotonic() + SETTLE_TIME
        if client.get_state().recordings:
            client.close("all")
        opened = client.open([str(Path(path).resolve()) for path in paths])
        while (state := client.get_state()).loading or not state.views:
            if time.monotonic() > deadline:
                raise LogError(f"{paths[0]}: the viewer shows nothing of it after {SETTLE_TIME:.0f} s")
            time.sleep(_POLL)
        if len(paths) > 1:
            _, dataset, _ = opened.store_ids[0].split(":", 2)
            client.set_location(f"{state.catalog_url}/entry/{dataset}")
            return
        if callable(at):
            shown = state.recordings[0]
            at = at(next(line for line in shown.timelines if line.name == shown.current_timeline))
        client.set_time(play_state="paused", **(at or {}))

    def shot(self) -> Shot:
        """Return a picture once the view does not change any more."""
        _settle(self._client, time.monotonic() + SETTLE_TIME)
        return self._shot()

    def glance(self) -> Shot:
        """Return a picture as soon as everything is drawn once, which is enough for the reports of the views."""
        for _ in range(2):  # a view reports when it is drawn, and plots are drawn after their data are loaded
            self._client.take_screenshot(max_size=_PROBE_SIZE)
        return self._shot()

    def _shot(self) -> Shot:
        views = self._client.get_state().views
        reports = tuple(
            f"{view.name}: {report.severity}: {report.summary}" for view in views for report in view.reports
        )
        return Shot(self._client.take_screenshot(), tuple(view.name for view in views), reports)


def executable() -> str:
    """Return the path of the viewer's own program.

    The `rerun` script starts it as a child, which keeps running when the script is ended.
    """
    import rerun_cli  # type: ignore[import-untyped]

    name = "rerun.exe" if os.name == "nt" else "rerun"
    found = Path(rerun_cli.__file__).with_name(name)
    if not found.exists():
        raise LogError(
            f"the Rerun viewer is not at '{found}'; install it again: pip install --force-reinstall rerun-sdk"
        )
    return str(found)


def last_error(stream: IO[bytes]) -> str:
    """Return the line of a viewer's error output that states why it ended."""
    stream.seek(0)
    plain = _COLOUR.sub("", stream.read().decode(errors="replace"))
    lines = [line.strip() for line in plain.splitlines() if line.strip()]
    fatal = [line for line in lines if line.startswith("Error") or "panicked" in line]
    return (fatal or lines or ["no reason given"])[-1]


@contextmanager
def viewer(size: tuple[int, int] = (1600, 900)) -> Iterator[Viewer]:
    """Yield a viewer on the loopback interface, which is ended after the block.

    A LogError whose data hold `no_graphics` means that the machine has no graphics driver.
    """
    from rerun.experimental import ViewerClient

    port = _free_port()
    arguments = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    arguments += ["--memory-limit", "2GB", "--window-size", f"{size[0]}x{size[1]}"]
    with TemporaryFile() as complaints:
        process = subprocess.Popen(  # noqa: S603  # our own arguments
            [executable(), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            start_new_session=True,
            env=os.environ | {"CI": "1"},  # no usage statistics from pictures and tests
        )
        try:
            _await_port(process, port, complaints)
            with ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy") as client:
                _await_answer(process, client, complaints)
                try:
                    client.take_screenshot(max_size=_PROBE_SIZE)  # a viewer that cannot draw ends here
                    yield Viewer(client)
                except OSError as error:  # what the client raises when the viewer is gone
                    with suppress(subprocess.TimeoutExpired):
                        process.wait(END_TIME)
                    _check_running(process, complaints)
                    raise LogError(f"the viewer does not answer any more: {error}") from error
        finally:
            _end(process)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _await_port(process: subprocess.Popen[bytes], port: int, complaints: IO[bytes]) -> None:
    deadline = time.monotonic() + START_TIME
    while time.monotonic() < deadline:
        _check_running(process, complaints)
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=0.5):
            return
        time.sleep(_POLL)
    raise LogError(f"the viewer did not start within {START_TIME:.0f} s")


def _await_answer(process: subprocess.Popen[bytes], client: ViewerClient, complaints: IO[bytes]) -> None:
    """Wait for the first answer: the port opens before the viewer can answer or has found a graphics driver."""
    deadline = time.monotonic() + START_TIME
    while True:
        try:
            client.get_state()
        except Exception as error:  # whatever the transport raises, until the viewer answers
            _check_running(process, complaints)
            if time.monotonic() > deadline:
                raise LogError(f"the viewer does not answer: {error}") from error
            time.sleep(_POLL)
        else:
            return


def _check_running(process: subprocess.Popen[bytes], complaints: IO[bytes]) -> None:
    if process.poll() is None:
        return
    words = last_error(complaints)
    if any(sign in words for sign in _SIGNS_OF_NO_DRIVER):
        raise LogError(NO_DRIVER, no_graphics=True)
    raise LogError(f"the viewer ended at once: {words}")


def _settle(client: ViewerClient, deadline: float) -> None:
    """Wait for three equal pictures in a row, because plots load one by one and notices fade."""
    last, same = b"", 0
    while same < 2 and time.monotonic() < deadline:
        picture = client.take_screenshot(max_size=_PROBE_SIZE)
        same = same + 1 if picture == last else 0
        last = picture
        time.sleep(5 * _POLL)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Ask the viewer to end, then kill it if it does not."""
    process.terminate()
    try:
        process.wait(END_TIME)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
