"""The group of commands, and what the terminal shows: errors, notes, the verdict of a run, progress."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

import click

from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, RequestError, TooLargeError
from kinfmu.version import VERSION

if TYPE_CHECKING:
    from kinfmu.run import Run


ORDER = (
    "list",
    "new",
    "import",
    "check",
    "report",
    "play",
    "solve",
    "fit",
    "study",
    "build",
    "simulate",
    "verify",
    "review",
    "export",
    "recover",
    "schema",
)


class _Command(click.Command):
    """A command that reports a RequestError as wrong usage."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except TooLargeError:
            raise
        except RequestError as error:
            raise click.UsageError(one_line(error), ctx) from None


class _Program(click.Command):
    """A program that reports a KinfmuError as one line on stderr with exit status 1."""

    def invoke(self, ctx: click.Context) -> Any:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of numpy, imported later: its threads slow small matrices
        if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
            sys.stdout.reconfigure(errors="surrogateescape")  # the name of a file need not be UTF-8
        try:
            with _signals_as_exceptions():
                return super().invoke(ctx)
        except KinfmuError as error:
            click.echo(f"kinfmu: {one_line(error)}", err=True)
            ctx.exit(1)
        except MemoryError:
            click.echo("kinfmu: not enough memory for a mechanism of this size", err=True)
            ctx.exit(1)


class ProgramOfOneCommand(_Program, _Command):
    """A program without further commands."""


class _Group(_Program, click.Group):
    """A program of several commands."""

    command_class = _Command

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Return the commands in the order of work."""
        return sorted(self.commands, key=ORDER.index)


@contextmanager
def _signals_as_exceptions() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end this block as an exception does, so that no half-written file remains."""

    def end(number: int, _frame: Any) -> NoReturn:
        click.echo(f"kinfmu: ended by {signal.Signals(number).name}", err=True)
        raise SystemExit(128 + number)  # the exit status that shells use

    changed = []
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)  # Windows has no SIGHUP
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, end)
                changed.append(number)
    try:
        yield
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(VERSION, prog_name="kinfmu")
def main() -> None:
    """Planar kinematics: from a mechanism file to an FMU and logs that you can review.

    MECH is a name of the gallery (kinfmu list) or a mechanism file (.toml). FILE, RUN and FMU are files. Numbers may
    have units: 90deg, 40mm, 30rpm, 10ms. Bare angles are in radians.

    \b
    A first tour:
      kinfmu play jansen_leg               drag a mechanism in the browser
      kinfmu new crank_rocker mine.toml    write a commented mechanism file
      kinfmu check mine.toml               report its properties
      kinfmu simulate mine.toml            build and step its FMU, write logs
      kinfmu review logs/mine.mcap         open the run in the viewer

    Exit status: 0 success, 1 error in the mechanism or the run, 2 wrong usage.
    """  # noqa: D301  click leaves lines behind a backspace as they are


def one_line(error: KinfmuError) -> str:
    """Return the message on a single line."""
    return printable(str(error))


@contextmanager
def errors_of(mechanism: str) -> Iterator[None]:
    """Put the name of the mechanism's file before the messages of errors in this block."""
    try:
        yield
    except (RequestError, MechanismError, AssemblyError) as error:
        raise type(error)(f"{mechanism}: {error}", **error.data) from None


@contextmanager
def on_interrupt(text: str) -> Iterator[None]:
    """Report Ctrl-C in this block, or function, as `text`, with exit status 1."""
    try:
        yield
    except KeyboardInterrupt:
        raise KinfmuError(text) from None


@contextmanager
def errors_as(path: str, name: str) -> Iterator[None]:
    """Report errors under the user's file name, not under that of a temporary file."""
    try:
        yield
    except KinfmuError as error:
        raise type(error)(str(error).replace(path, name), **error.data) from None


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
    """Print a note if this block, which makes a page, lasts longer: that of a large mechanism does.

    hint: added to the note, such as how to do without the page.
    """
    timer = threading.Timer(seconds, note, [f"making the page{hint}"])
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
