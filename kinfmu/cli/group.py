"""The group of commands, and how what went wrong is told."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from kinfmu import VERSION
from kinfmu.cli.tell import printable
from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, RequestError

ORDER = ("list", "new", "check", "solve", "build", "simulate", "review", "export", "recover", "schema", "bench")


class _Command(click.Command):
    """Tells what was asked for and is not there as wrong usage."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except RequestError as error:
            raise click.UsageError(one_line(error), ctx) from None


class _Group(click.Group):
    """Turns what kinfmu raises on purpose into one line on stderr and exit status 1."""

    command_class = _Command

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Commands in the order of work; those that are not in it come last."""
        return sorted(self.commands, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with _ended_in_order():
                return super().invoke(ctx)
        except KinfmuError as error:
            click.echo(f"kinfmu: {one_line(error)}", err=True)
            ctx.exit(1)
        except MemoryError:
            click.echo("kinfmu: there is not enough memory for so large a mechanism", err=True)
            ctx.exit(1)


@contextmanager
def _ended_in_order() -> Iterator[None]:
    """SIGTERM and SIGHUP end this block as an exception does, so that no half-written file stays behind."""

    def end(number: int, _frame: Any) -> NoReturn:
        click.echo(f"kinfmu: ended by {signal.Signals(number).name}", err=True)
        raise SystemExit(128 + number)  # as shells count

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
    """Planar kinematics: from a mechanism file to an FMU and logs that can be reviewed.

    MECH is a name of the gallery (kinfmu list) or a mechanism file (.toml); FILE, RUN and FMU are files. Numbers may
    carry a unit, as 90deg, 40mm, 30rpm and 10ms do; bare angles are in radians.

    \b
    A first tour:
      kinfmu new fourbar mine.toml    a commented mechanism file to change
      kinfmu check mine.toml          what it can do
      kinfmu simulate mine.toml       its FMU, stepped and logged
      kinfmu review logs/mine.mcap

    Exit status: 0 fine, 1 the mechanism or the run is at fault, 2 wrong usage.
    """  # noqa: D301  click leaves lines behind a backspace as they are


def one_line(error: KinfmuError) -> str:
    """The message on a single line."""
    return printable(str(error))


@contextmanager
def about(mechanism: str) -> Iterator[None]:
    """What is found wrong in a mechanism after its file was read is told with the file's name in front."""
    try:
        yield
    except (RequestError, MechanismError, AssemblyError) as error:
        raise type(error)(f"{mechanism}: {error}", **error.data) from None


@contextmanager
def stopped(text: str) -> Iterator[None]:
    """Ctrl-C in this block, or function, is told as `text`, with exit status 1 as everywhere."""
    try:
        yield
    except KeyboardInterrupt:
        raise KinfmuError(text) from None


@contextmanager
def instead(path: str, name: str) -> Iterator[None]:
    """What is found wrong is told of what the user named, not of a file made on the way."""
    try:
        yield
    except KinfmuError as error:
        raise type(error)(str(error).replace(path, name), **error.data) from None
