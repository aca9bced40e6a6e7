"""The group of commands, and how errors are reported."""

from __future__ import annotations

import io
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from kinfmu.cli.messages import printable
from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, RequestError
from kinfmu.version import VERSION

ORDER = (
    "list",
    "new",
    "check",
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
        except RequestError as error:
            raise click.UsageError(one_line(error), ctx) from None


class _Program(click.Command):
    """A program that reports a KinfmuError as one line on stderr with exit status 1."""

    def invoke(self, ctx: click.Context) -> Any:
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
      kinfmu new crank_rocker mine.toml    write a commented mechanism file, to edit
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
