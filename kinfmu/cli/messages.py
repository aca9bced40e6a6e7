"""What the terminal shows of a run: messages, one line each, and progress on stderr; the verdict on stdout."""

from __future__ import annotations

import sys
import threading
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from kinfmu.errors import KinfmuError

if TYPE_CHECKING:
    from kinfmu.run import Run


LONG_RUN = 2000  # samples from which a progress bar is worth a line


def printable(text: str) -> str:
    """Return the text on one line, with control characters escaped: files may contain terminal codes."""
    line = " ".join(text.splitlines())
    return "".join(f"\\x{ord(c):02x}" if unicodedata.category(c) == "Cc" else c for c in line)


def note(text: str) -> None:
    """Print how an input was understood, or which default was chosen."""
    click.echo(f"kinfmu: note: {printable(text)}", err=True)


def warn(text: str) -> None:
    """Print a warning of a probable mistake."""
    click.echo(f"kinfmu: warning: {printable(text)}", err=True)


@contextmanager
def patience(seconds: float = 6.0, hint: str = "") -> Iterator[None]:
    """Print a note if this block, which makes a page, lasts longer: zig compiles its C library once, for a minute.

    hint: added to the note, such as how to do without the page.
    """
    from kinfmu.codegen.c.library_cache import holds_any

    first = "" if holds_any(".wasm") else "; the first page on this machine takes a minute, others seconds"
    timer = threading.Timer(seconds, note, [f"compiling the page{first}{hint}"])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def report(run: Run, *after: str, by_samples: bool = False) -> None:
    """Print the notes and warnings of a finished run, each once, and its verdict.

    Args:
        run: The run.
        after: What follows the verdict: the end of its line, then other lines.
        by_samples: True: the times of the run are sample numbers, from 0.

    Raises:
        KinfmuError: The first event of level "error", with its time [s].

    """
    from kinfmu.run.verdict import sentence

    printers = {"info": note, "warning": warn}
    for level, text in dict.fromkeys((event.level, event.text) for event in run.events):
        if level in printers:
            printers[level](text)
    click.echo("\n".join(["; ".join([sentence(run), *after[:1]]), *after[1:]]))
    for event in run.events:
        if event.level == "error":
            has_time = event.text.startswith("at t = ")  # an FMU writes the time itself
            when = f"sample {event.t:.0f}" if by_samples else f"at t = {event.t:g} s"
            raise KinfmuError(event.text if has_time else f"{when}: {event.text}")


class Progress:
    """A progress bar on stderr for at least `least` steps, if stderr is a terminal."""

    def __init__(self, label: str = "simulating", least: int = LONG_RUN) -> None:
        self.label = label
        self.least = least
        self._bar: Any = None
        self._done = 0

    def __enter__(self) -> Callable[[int, int], None]:
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.render_finish()

    def _show(self, done: int, count: int) -> None:
        if self._bar is None:
            if count < self.least or not sys.stderr.isatty():
                return
            self._bar = click.progressbar(length=count, label=self.label, file=sys.stderr)
            self._bar.render_progress()
        if done - self._done >= count // 200 or done == count:
            self._bar.update(done - self._done)
            self._done = done
