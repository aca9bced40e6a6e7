"""The server of `kinfmu play`: a page, the changes of its file, its drawing, and FMUs with the lengths as set.

Only programs of this machine reach it, and only with the token in its address. Requests of pages of other sites are
refused: by their Origin, by the browser's Sec-Fetch-Site, and by their Host, which differs if a foreign host name
resolves to this machine (DNS rebinding).
"""

from __future__ import annotations

import json
import secrets
import threading
from collections.abc import Sequence
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np

import kinfmu
from kinfmu.draw import animate, dxf
from kinfmu.errors import KinfmuError
from kinfmu.files import temporary_folder
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.page.editor import StaleState, answer, view
from kinfmu.page.html import gallery_page, page
from kinfmu.page.player.source import PlaySource

ADDRESS = "127.0.0.1"
LARGEST_BODY = 4_000_000  # [bytes] of a mechanism file, or of operations on one
HEARTBEAT = 10.0  # [s]; a closed page is noticed when this line cannot be sent
SILENCE = 30.0  # [s] that a request may take to arrive
MOST_COPIES = 1000
_FRAMES = 201  # of an animation, and poses on the way to one that is drawn

_SECURITY = {
    "Content-Security-Policy": "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


class Refusal(Exception):  # noqa: N818  not an error of the program: the answer to a request
    """A request that is answered by a status and one line."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status = status


class PlayServer:
    """Serves the page of a source and watches its file, within a `with` block.

    Args:
        source: What is played.
        port: Port on this machine. Default: a free one.

    Raises:
        KinfmuError: The port is in use.

    """

    def __init__(self, source: PlaySource, port: int = 0) -> None:
        self.source = source
        self._token = secrets.token_urlsafe(24)
        try:
            self._server = _Server((ADDRESS, port), self)
        except OSError as error:
            raise KinfmuError(
                f"port {port} cannot be used ({error.strerror}); choose another one, or none for a free one"
            ) from None
        self._threads = [
            threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True),
            threading.Thread(target=source.watch, daemon=True),
        ]
        self._building = threading.Lock()
        self._viewing = threading.Lock()
        self._view: tuple[int, bytes] = (0, b"")  # of a state

    @property
    def port(self) -> int:
        """Port of this machine."""
        return int(self._server.server_address[1])

    @property
    def url(self) -> str:
        """Address of the page. Whoever knows it can use the server."""
        return f"http://{ADDRESS}:{self.port}/{self._token}/"

    def __enter__(self) -> PlayServer:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.source.close()
        self._server.shutdown()
        self._server.server_close()

    def place(self, path: str) -> str:
        """Return what a path asks for: the part after the token.

        Raises:
            Refusal: The path does not begin with the token.

        """
        first, slash, rest = urlsplit(path).path.removeprefix("/").partition("/")
        if not slash or not secrets.compare_digest(first.encode(), self._token.encode()):
            raise Refusal(
                HTTPStatus.NOT_FOUND, "there is nothing here; the address that kinfmu play printed has a token"
            )
        return rest

    def build_fmu(self, mechanism: Mechanism, fmi: int) -> bytes:
        """Return the FMU of a mechanism; one is built at a time.

        Args:
            mechanism: The mechanism.
            fmi: Version of FMI, 2 or 3.

        Raises:
            KinfmuError: It cannot be built.

        """
        with self._building, temporary_folder() as folder:
            return kinfmu.build(mechanism, folder, fmi=fmi).read_bytes()

    def export(self, mechanism: Mechanism, suffix: str, values: Sequence[float] = ()) -> bytes:
        """Return what `kinfmu export` writes of a mechanism; one file is made at a time.

        Args:
            mechanism: The mechanism.
            suffix: ".gif": its run; ".dxf": a pose.
            values: Driver values of that pose.

        Raises:
            KinfmuError: It cannot be written, or the pose is unreachable.

        """
        with self._building, temporary_folder() as folder:
            path = folder / f"{mechanism.name}{suffix}"
            if suffix == ".gif":
                animate(kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, _FRAMES)), path)
            else:
                starts = [float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers]
                inputs = [str(driver.inputs()[0]) for driver in mechanism.drivers]
                path_of = [np.linspace(start, value, _FRAMES) for start, value in zip(starts, values, strict=True)]
                given: dict[str, Any] = dict(zip(inputs, path_of, strict=True))
                run = kinfmu.solve(mechanism, **given)
                dxf(run.part(np.arange(len(run)) == len(run) - 1), path)
            return path.read_bytes()

    def drawing(self) -> tuple[int, dict[str, Any]]:
        """Return the number of the current state of the drawing, and the answer to a page.

        Raises:
            KinfmuError: The file cannot be edited.

        """
        number, drawing, about = self.source.session().current()
        return number, answer(drawing) | about

    def view(self, asked: str) -> bytes:
        """Return the full data of the page of the current state, as JSON; one is made at a time.

        Args:
            asked: The number of that state.

        Raises:
            StaleState: Another state is the current one.
            KinfmuError: It cannot be solved.

        """
        with self._viewing:
            number, drawing, _ = self.source.session().current()
            if str(number) != asked:
                raise StaleState(f"state {asked[:20]} is no longer the current one; it is {number} now")
            if self._view[0] != number:
                self._view = number, _json(view(drawing) | {"state": number})
            return self._view[1]

    def save(self, text: str) -> Path:
        """Write a mechanism file next to that of the source, under a name that is not in use, and return its path.

        Raises:
            KinfmuError: It cannot be written.

        """
        folder, stem = self.source.folder, self.source.path.stem if self.source.path else self.source.mechanism.name
        for number in range(1 if self.source.path is None else 2, MOST_COPIES):
            path = folder / (f"{stem}.toml" if number == 1 else f"{stem}-{number}.toml")
            try:
                with path.open("x", encoding="utf-8", newline="\n") as file:
                    file.write(text)
            except FileExistsError:
                continue
            except OSError as error:
                raise KinfmuError(f"{path}: cannot be written ({error.strerror})") from None
            return path
        raise KinfmuError(f"{folder / stem}-2.toml to -{MOST_COPIES - 1}.toml are there already; remove some")


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = False  # another program's port is not shared

    def __init__(self, address: tuple[str, int], play: PlayServer) -> None:
        self.play = play
        super().__init__(address, _Handler)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout = SILENCE
    server_version = "kinfmu"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer with the page, the changes of its file, or its drawing."""
        members = {f"gallery/{name}": partial(self._member, name) for name in gallery.names()}
        answers: dict[str, object] = {"": self._page, "changes": self._changes, "editor": self._editor}
        self._answer(answers | {"editor/view": self._view, "gallery": self._gallery} | members)

    def do_POST(self) -> None:
        """Answer with an FMU, a page, the name of a file that was saved, or the drawing after a change."""
        changes = {f"editor/{name}": partial(self._edit, name) for name in ("operations", "undo", "redo", "save")}
        answers: dict[str, object] = {"fmu2": partial(self._fmu, 2), "fmu3": partial(self._fmu, 3), "file": self._file}
        answers |= {
            "page": self._page_of_file,
            "gif": partial(self._export, ".gif"),
            "dxf": partial(self._export, ".dxf"),
        }
        self._answer(answers | changes)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002  the name that http.server has
        """Write nothing: the terminal shows the address only."""

    def _answer(self, answers: dict[str, object]) -> None:
        try:
            self._check_sender()
            place = self.server.play.place(self.path)
            answer = answers.get(place)
            if not callable(answer):
                raise Refusal(HTTPStatus.NOT_FOUND, f"'{place}' is not known")
            answer()
        except Refusal as refusal:
            self._send_line(refusal.status, str(refusal))
        except KinfmuError as error:
            self._send_line(HTTPStatus.UNPROCESSABLE_ENTITY, str(error))
        except (BrokenPipeError, ConnectionError, TimeoutError):
            pass  # the page was closed

    def _check_sender(self) -> None:
        """Raise a Refusal for requests that a page of another site may have made."""
        own = [f"{name}:{self.server.play.port}" for name in (ADDRESS, "localhost")]
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or hosts[0].lower() not in own:
            raise Refusal(HTTPStatus.MISDIRECTED_REQUEST, f"only requests to {own[0]} are answered")
        origin = self.headers.get("Origin")
        if origin is not None and origin.lower() not in [f"http://{host}" for host in own]:
            raise Refusal(HTTPStatus.FORBIDDEN, "requests of other sites are refused")
        is_navigation = (
            self.command == "GET" and self.headers.get("Sec-Fetch-Dest") == "document"
        )  # a link was followed
        if self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin") and not is_navigation:
            raise Refusal(HTTPStatus.FORBIDDEN, "requests of other sites are refused")

    def _send(self, status: HTTPStatus, kind: str, data: bytes) -> None:
        self.send_response(status)
        self._send_headers({"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(data))})
        self.wfile.write(data)

    def _send_line(self, status: HTTPStatus, line: str) -> None:
        self._send(status, "text/plain", line.encode("utf-8", "backslashreplace"))

    def _send_headers(self, headers: dict[str, str]) -> None:
        for name, value in (headers | _SECURITY).items():
            self.send_header(name, value)
        self.end_headers()

    def _page(self) -> None:
        self._send(HTTPStatus.OK, "text/html", self.server.play.source.page().encode())

    def _gallery(self) -> None:
        self._send(HTTPStatus.OK, "text/html", gallery_page().encode())

    def _member(self, name: str) -> None:
        script = 'started.then((page) => page.linkGallery("../gallery"));'
        self._send(HTTPStatus.OK, "text/html", page(gallery.load(name), script=script).encode())

    def _changes(self) -> None:
        """Send the state now and after every change, as server-sent events."""
        source = self.server.play.source
        self.send_response(HTTPStatus.OK)
        self._send_headers({"Content-Type": "text/event-stream"})
        seen = 0
        while not source.is_closed:
            state = source.wait(seen, HEARTBEAT)
            if state is None:
                self.wfile.write(b":\n\n")
            else:
                seen = state.change
                shown = {"version": state.version, "problem": state.problem, "isBusy": state.is_busy}
                data = json.dumps(shown | {"editor": state.editor})
                self.wfile.write(f"event: state\ndata: {data}\n\n".encode())

    def _fmu(self, fmi: int) -> None:
        mechanism, _ = self._mechanism()
        self._send(HTTPStatus.OK, "application/zip", self.server.play.build_fmu(mechanism, fmi))

    def _export(self, suffix: str) -> None:
        mechanism, _ = self._mechanism()
        try:
            values = [float(value) for value in parse_qs(urlsplit(self.path).query).get("values", [])]
        except ValueError:
            values = []
        if suffix == ".dxf" and not (len(values) == len(mechanism.drivers) and np.isfinite(values).all()):
            raise Refusal(HTTPStatus.BAD_REQUEST, "values= is required: a number for each driver")
        self._send(HTTPStatus.OK, "application/octet-stream", self.server.play.export(mechanism, suffix, values))

    def _page_of_file(self) -> None:
        mechanism, _ = self._mechanism()
        self._send(HTTPStatus.OK, "text/html", page(mechanism).encode())

    def _file(self) -> None:
        _, text = self._mechanism()
        self._send(HTTPStatus.OK, "text/plain", str(self.server.play.save(text)).encode())

    def _editor(self) -> None:
        self._send_drawing(HTTPStatus.OK)

    def _view(self) -> None:
        (asked,) = parse_qs(urlsplit(self.path).query).get("state", [""])[:1]
        try:
            self._send(HTTPStatus.OK, "application/json", self.server.play.view(asked))
        except StaleState:
            self._send(HTTPStatus.NO_CONTENT, "text/plain", b"")  # its page knows the newer state soon

    def _edit(self, what: str) -> None:
        """Change the drawing; a change of another state than the current one is answered with the current one."""
        asked, source = self._object(), self.server.play.source
        session, number = source.session(), asked.get("state")
        try:
            if what == "operations":
                session.operate(number, asked.get("operations"))
            elif what == "save":
                session.save(number, force=asked.get("force") is True)
            elif what == "undo":
                session.undo(number)
            else:
                session.redo(number)
        except StaleState as problem:
            source.report_states()
            self._send_drawing(HTTPStatus.CONFLICT, problem=str(problem))
        else:
            source.report_states()
            self._send_drawing(HTTPStatus.OK)

    def _send_drawing(self, status: HTTPStatus, **more: str) -> None:
        _, found = self.server.play.drawing()
        self._send(status, "application/json", _json(found | more))

    def _object(self) -> dict[str, Any]:
        """Return the JSON object in the body of the request."""
        try:
            found = json.loads(self._body(), parse_constant=_refuse_constant)
        except (ValueError, RecursionError):
            raise Refusal(HTTPStatus.BAD_REQUEST, "the body must be a JSON object without NaN and Infinity") from None
        if not isinstance(found, dict):
            raise Refusal(HTTPStatus.BAD_REQUEST, "the body must be a JSON object")
        return found

    def _mechanism(self) -> tuple[Mechanism, str]:
        """Return the mechanism in the body of the request, and its text; files that it names are refused."""
        text = self._body()
        return parse(text, "mechanism as set"), text

    def _body(self) -> str:
        """Return the body of the request, which is text."""
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise Refusal(HTTPStatus.LENGTH_REQUIRED, "the length of the body is required")
        if len(length) > 12 or int(length) > LARGEST_BODY:
            raise Refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {LARGEST_BODY} bytes are read")
        try:
            return self.rfile.read(int(length)).decode()
        except UnicodeDecodeError:
            raise Refusal(HTTPStatus.BAD_REQUEST, "a mechanism file is text in UTF-8") from None


def _json(value: object) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")
