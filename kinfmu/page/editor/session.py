"""The states of a drawing, each kept on disk before it is answered, and saving into the file of the user.

A folder of the user's own holds the text of every state and a list of them: `states.json` names the texts in order, the
current one, and what the file held when it was last read or saved. Everything is written to a temporary file that then
takes the place of the older one, the texts before the list, so that a list never names a text that is not there. A
state is an undo step; those of a drawing that is saved are removed a month after the last one. Several processes on one
file share the folder: each looks at the list before it answers.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.files import lock_folder, write_whole
from kinfmu.page.editor.drawing import Drawing, new_text
from kinfmu.page.editor.operations import changed

MOST_STATES = 1000  # that can be undone
KEPT = 30 * 86400.0  # [s] after the last step, of a drawing that is saved
_LIST = "states.json"


class StaleState(RequestError):  # noqa: N818  not an error of the program: another tab or program was faster
    """A request for a state that is no longer the current one, or to save over a file that another program wrote."""


@dataclass(frozen=True)
class States:
    """The list of states.

    number: of the current state, which grows with every change; texts: names of their files, in order; at: index of
    the current one; saved: the digest of what the file holds as far as is known, "" if there is no file.
    """

    number: int
    texts: tuple[str, ...]
    at: int
    saved: str


class Session:
    """The states of the drawing of one file.

    Args:
        path: The file; it may be missing, then the drawing begins empty.

    Raises:
        KinfmuError: The file cannot be read or is invalid, or the folder of the states cannot be written.

    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path).absolute()
        self._own = states_folder() / hashlib.sha256(os.path.realpath(self.path).encode()).hexdigest()[:24]
        self._folder = self._own / "states"  # within the folder that is locked
        self._lock = threading.RLock()
        self._drawings: dict[str, Drawing] = {}
        with self._alone():
            self._take_file(self._read(), is_begin=True)
        _remove_old(self._own.parent, but=self._own)

    def close(self) -> None:
        """Remove the states if nothing is unsaved and there is nothing to undo or redo."""
        with self._alone():
            states = self._read()
            is_begun = len(states.texts) == 1 and self._on_disk()[1] in (self._text(states), None)
            if is_begun and (states.saved or self._text(states) == new_text(self.path.stem)):
                shutil.rmtree(self._own, ignore_errors=True)

    # ---- what there is

    @property
    def number(self) -> int:
        """Number of the current state."""
        with self._alone():
            return self._read().number

    def stamp(self) -> int:
        """Return what changes with the states, of this process or of another one."""
        try:
            return (self._folder / _LIST).stat().st_mtime_ns
        except OSError:
            return 0

    def current(self) -> tuple[int, Drawing, dict[str, Any]]:
        """Return the number of the current state, its drawing, and the keys of an answer that belong to the session."""
        with self._alone():
            states = self._take_file(self._read())
            return states.number, self._drawing(states), self._about(states)

    def _about(self, states: States) -> dict[str, Any]:
        text = self._text(states)
        return {
            "state": states.number,
            "isSaved": _digest(text) == states.saved,
            "canUndo": states.at > 0,
            "canRedo": states.at + 1 < len(states.texts),
            "isFileChanged": self._on_disk()[0] != states.saved,
        }

    # ---- changes

    def operate(self, number: object, operations: object) -> None:
        """Make operations on the current state; they become one new state.

        Raises:
            StaleState: `number` is not that of the current state.
            MechanismError: An operation is not possible.

        """
        with self._alone():
            states = self._checked(number)
            drawing = self._drawing(states)
            if operations == [{"do": "reload"}]:
                digest, text = self._on_disk()
                if text is None:
                    raise MechanismError(f"{self.path} is not there or is no text, so it cannot be loaded")
                self._push(replace(states, saved=digest), Drawing.of(text, self.path.parent))
                return
            after = changed(drawing, operations)
            if after.text != drawing.text:
                self._push(states, after)

    def undo(self, number: object) -> None:
        """Go one state back.

        Raises:
            StaleState: `number` is not that of the current state.
            RequestError: There is no earlier state.

        """
        self._step(number, -1, "there is nothing to undo")

    def redo(self, number: object) -> None:
        """Go one state forward again.

        Raises:
            StaleState: `number` is not that of the current state.
            RequestError: There is no later state.

        """
        self._step(number, 1, "there is nothing to redo")

    def _step(self, number: object, by: int, problem: str) -> None:
        with self._alone():
            states = self._checked(number)
            if not 0 <= states.at + by < len(states.texts):
                raise RequestError(problem)
            self._write(replace(states, number=states.number + 1, at=states.at + by))

    def save(self, number: object, *, force: bool = False) -> None:
        """Write the text of the current state into the file.

        Args:
            number: Of the current state.
            force: True to write over a text that another program wrote, which becomes a state to undo to.

        Raises:
            StaleState: `number` is not that of the current state, or another program wrote the file.
            MechanismError: The file cannot be written.

        """
        with self._alone():
            states = self._checked(number)
            text = self._text(states)
            digest, other = self._on_disk()
            if digest not in (states.saved, _digest(text)):
                if not force:
                    raise StaleState(f"{self.path.name} was changed by another program; load it, or save over it")
                if other is None:
                    raise MechanismError(f"{self.path} is no text, so it is not overwritten")
                texts = [*states.texts]
                texts.insert(states.at, self._keep(other))
                states = replace(states, texts=tuple(texts), at=states.at + 1)
                self._write(states)
            try:
                write_whole(self.path, text.encode(), is_durable=True)
            except OSError as error:
                raise MechanismError(f"{self.path}: cannot be written ({error.strerror or error})") from None
            self._write(replace(states, number=states.number + 1, saved=_digest(text)))

    def _checked(self, number: object) -> States:
        states = self._take_file(self._read())
        if isinstance(number, bool) or number != states.number:
            raise StaleState(f"this is no longer the current drawing; it is state {states.number} now")
        return states

    def _push(self, states: States, drawing: Drawing) -> States:
        """Make a text the current state after the current one; later ones are gone."""
        name = self._keep(drawing.text)
        self._drawings[name] = drawing
        texts = (*states.texts[: states.at + 1], name)[-MOST_STATES:]
        return self._write(replace(states, number=states.number + 1, texts=texts, at=len(texts) - 1))

    def _take_file(self, states: States, *, is_begin: bool = False) -> States:
        """Make the text of the file a state, if another program wrote it and nothing here is unsaved.

        is_begin: True when the program begins: then it is a state in any case, and one can go back to what is unsaved.
        """
        digest, text = self._on_disk()
        if states.texts and is_begin and not digest and states.saved:  # the file was removed
            return self._push(replace(states, saved=""), Drawing.of(new_text(self.path.stem), self.path.parent))
        if states.texts:
            is_unsaved = _digest(self._text(states)) != states.saved
            if digest == states.saved or text is None or (is_unsaved and not is_begin):
                return states
            try:
                drawing = Drawing.of(text, self.path.parent)
            except MechanismError:
                return states  # half written, or with an error that its page reports
            return self._push(replace(states, saved=digest), drawing)
        if text is None and digest:
            raise MechanismError(f"{self.path} is no text in UTF-8")
        begun = Drawing.of(new_text(self.path.stem) if text is None else text, self.path.parent)
        return self._push(replace(states, saved=digest), begun)

    # ---- disk

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the states of this file alone, among threads and processes."""
        with self._lock:
            try:
                self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                with lock_folder(self._own):
                    self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)  # another process may have closed it
                    yield
            except OSError as error:
                raise KinfmuError(
                    f"states of drawings cannot be kept in '{self._folder}': {error.strerror or error}; set "
                    "KINFMU_STATES to a folder that you can write"
                ) from None

    def _read(self) -> States:
        """Return the list of states; an empty one if there is none, or none that can be read."""
        try:
            found = json.loads((self._folder / _LIST).read_text("utf-8"))
            states = States(int(found["number"]), tuple(found["texts"]), int(found["at"]), str(found["saved"]))
            self._text(states)
        except (OSError, ValueError, KeyError, TypeError, IndexError):
            return States(0, (), -1, "")
        return states

    def _write(self, states: States) -> States:
        data = {"number": states.number, "texts": states.texts, "at": states.at, "saved": states.saved}
        write_whole(self._folder / _LIST, json.dumps(data | {"file": str(self.path)}).encode(), is_durable=True)
        for path in self._folder.glob("*.toml"):
            if path.name not in states.texts:
                with suppress(OSError):
                    path.unlink()
        self._drawings = {name: one for name, one in self._drawings.items() if name in states.texts[-3:]}
        return states

    def _keep(self, text: str) -> str:
        """Write a text under the name of its content, and return that name."""
        name = f"{_digest(text)[:32]}.toml"
        path = self._folder / name
        if not path.exists() or path.read_bytes() != text.encode():
            write_whole(path, text.encode(), is_durable=True)
        return name

    def _text(self, states: States) -> str:
        return (self._folder / states.texts[states.at]).read_bytes().decode()

    def _drawing(self, states: States) -> Drawing:
        name = states.texts[states.at]
        if name not in self._drawings:
            self._drawings[name] = Drawing.of(self._text(states), self.path.parent)
        return self._drawings[name]

    def _on_disk(self) -> tuple[str, str | None]:
        """Return the digest and the text of the file, "" and None without a file; of what is no text only a digest."""
        try:
            data = self.path.read_bytes()
        except FileNotFoundError:
            return "", None
        except OSError as error:
            raise MechanismError(f"{self.path} cannot be read ({error.strerror or error})") from None
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            return hashlib.sha256(data).hexdigest(), None
        return _digest(text), text


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _remove_old(folder: Path, but: Path) -> None:
    """Remove the states of drawings that were not used for `KEPT` and whose files have what was drawn."""
    for own in folder.iterdir():
        states = own / "states"
        with suppress(OSError, ValueError, KeyError, TypeError, IndexError):
            if own == but or time.time() - (states / _LIST).stat().st_mtime < KEPT:
                continue
            with lock_folder(own):
                found = json.loads((states / _LIST).read_text("utf-8"))
                if (states / found["texts"][found["at"]]).read_bytes() == Path(found["file"]).read_bytes():
                    shutil.rmtree(own, ignore_errors=True)


def states_folder() -> Path:
    """Return the folder of the states of drawings: KINFMU_STATES, or one in the user's folder of states."""
    given = os.environ.get("KINFMU_STATES")
    if given:
        return Path(given).absolute()
    try:
        home = Path.home()
    except RuntimeError:
        raise KinfmuError("there is no home folder for states of drawings; set KINFMU_STATES to a folder") from None
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")) / "kinfmu" / "drawings"
    if sys.platform == "darwin":
        return home / "Library" / "Application Support" / "kinfmu" / "drawings"
    return Path(os.environ.get("XDG_STATE_HOME") or home / ".local" / "state").absolute() / "kinfmu" / "drawings"
