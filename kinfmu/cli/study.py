"""kinfmu study: measure many designs of a mechanism."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from shlex import quote

import click

from kinfmu.cli.arguments import InputFile, OutputFile, names_in
from kinfmu.cli.check import FIGURES
from kinfmu.cli.group import main
from kinfmu.cli.messages import printable
from kinfmu.errors import KinfmuError


@main.command(epilog="Example: kinfmu study tolerances.toml --figure tolerances.svg")
@click.argument("file", type=InputFile(".toml"))
@click.option(
    "-o",
    "output",
    type=OutputFile(".parquet"),
    help="The results. Default: the name of FILE with .parquet, in the current folder.",
)
@click.option("--workers", type=click.IntRange(1), help="Processes on this machine. Default: one for each core.")
@click.option(
    "--dask",
    metavar="ADDRESS",
    help="Measure on a Dask cluster: the address of its scheduler, such as tcp://host:8786; or 'local', a cluster that "
    "is started on this machine.",
)
@click.option(
    "--engine",
    type=click.Choice(["auto", "python", "native"]),
    default="auto",
    show_default=True,
    help="native: compiled C; auto: native from some hundred designs on.",
)
@click.option("--restart", is_flag=True, help="Begin again, without the parts that an earlier run left.")
@click.option("--figure", "picture", type=OutputFile(*FIGURES), help="Draw the results into a .svg, .png or .pdf file.")
@click.option("--measures", metavar="NAMES", help="Only these measures in the figure, such as stroke,swing.")
def study(
    file: Path,
    output: Path | None,
    workers: int | None,
    dask: str | None,
    engine: str,
    restart: bool,
    picture: Path | None,
    measures: str | None,
) -> None:
    """Measure many designs: parameters on a grid, in ranges, or with tolerances.

    FILE names a mechanism and how its parameters vary (docs/studies.md). Prints a summary and writes a table with a row
    for each design. A study that was ended goes on where it was when the same command is given again.
    """
    from kinfmu.studies import read_study, run_study
    from kinfmu.studies.parts import folder_of

    if workers is not None and dask not in (None, "local"):
        raise click.UsageError("--workers is for this machine; the Dask cluster has its own")
    defined = read_study(file, engine=engine)
    target = output or Path(f"{file.stem}.parquet")
    shown = _Shown(f"kinfmu study {quote(str(file))}")
    try:
        result = run_study(defined, target, workers=workers, dask=dask, restart=restart, progress=shown)
    except KeyboardInterrupt:
        shown.end()
        raise KinfmuError(f"stopped; {_kept(shown, folder_of(target))}") from None
    except SystemExit:  # a signal
        shown.end()
        click.echo(f"kinfmu: {printable(_kept(shown, folder_of(target)))}", err=True)
        raise
    finally:
        shown.end()
    click.echo(str(result))
    click.echo(f"\nresults: {target}")
    if picture is not None:
        result.figure(picture, tuple(names_in(measures) or ()))
        click.echo(f"figure: {picture}")


def _kept(shown: _Shown, folder: Path) -> str:
    return f"{shown.done} of {shown.count} designs are kept in {folder}: the same command goes on from there"


class _Shown:
    """A line of progress with the time left on stderr, if that is a terminal."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.done = self.count = 0
        self._kept = 0
        self._begin = 0.0
        self._is_open = False

    def __call__(self, done: int, count: int) -> None:
        if not self.count:
            self._kept, self._begin = done, time.monotonic()
        self.done, self.count = done, count
        if not sys.stderr.isatty():
            return
        self._is_open = True
        spent, fresh = time.monotonic() - self._begin, done - self._kept
        left = f", {duration(spent * (count - done) / fresh)} left" if fresh and done < count else ""
        click.echo(f"\r{self.label}: {done} of {count} designs{left}\x1b[K", nl=False, err=True)

    def end(self) -> None:
        """End the line."""
        if self._is_open:
            click.echo(err=True)
        self._is_open = False


def duration(seconds: float) -> str:
    """Return '45 s', '3 min 20 s' or '2 h 5 min'."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"
