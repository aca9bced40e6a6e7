"""kinfmu export: a run as a file for other programs, or for a page; the kind chosen by the file's ending."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import TIME, names_in
from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import main
from kinfmu.errors import RequestError, listed
from kinfmu.suffix import suffix_of

if TYPE_CHECKING:
    from kinfmu.run import Run


def _table(run: Run, path: Path, columns: Sequence[str]) -> None:
    from kinfmu.log import write_table

    write_table(run, path, columns or None)


def _plot(run: Run, path: Path, columns: Sequence[str]) -> None:
    from kinfmu.draw import plot

    plot(run, path, columns)


def _animation(run: Run, path: Path, columns: Sequence[str]) -> None:  # noqa: ARG001  --columns is refused before
    from kinfmu.draw import animate

    animate(run, path)


FORMATS: dict[str, Callable[[Run, Path, Sequence[str]], None]] = {
    ".csv": _table,
    ".parquet": _table,
    ".npz": _table,
    ".svg": _plot,
    ".png": _plot,
    ".gif": _animation,
}
WITH_COLUMNS = [suffix for suffix, write in FORMATS.items() if write is not _animation]


def _between(run: Run, start: float | None, stop: float | None) -> Run:
    """The samples from start to stop [s], both included; all where nothing is said."""
    if start is None and stop is None:
        return run
    first, last = -math.inf if start is None else start, math.inf if stop is None else stop
    rows = (run.t >= first) & (run.t <= last)
    if not rows.any():
        told = f"{run.t[0]:g} to {run.t[-1]:g} s" if len(run) else "none"
        raise RequestError(f"--start, --stop: the run has no samples from {first:g} to {last:g} s; its samples: {told}")
    return run.part(rows, events=tuple(event for event in run.events if first <= event.t <= last))


@main.command(epilog="Example: kinfmu export logs/fourbar.mcap -o fourbar.svg --columns coupler.x,rocker.phi")
@click.argument("run", type=InputFile(".mcap"))
@click.option(
    "-o",
    "output",
    type=OutputFile(*FORMATS),
    required=True,
    help=f"The file to write: {listed(FORMATS)}.",
)
@click.option(
    "--columns",
    metavar="NAMES",
    help="Columns of a table, named as simulate --channels names them: coupler.x, coupler.*, q, -error; else all. Time "
    "and status are always there. Plots take the same names, for coordinates; else those of q.",
)
@click.option("--start", type=TIME, help="Only samples from then on [s].")
@click.option("--stop", type=TIME, help="Only samples until then [s].")
def export(run: Path, output: Path, columns: str | None, start: float | None, stop: float | None) -> None:
    """Write a run as a table, as plots, or as a moving picture.

    RUN is a record (.mcap) of simulate or solve. A table holds all columns, or those named; Parquet and npz
    the units, too. Plots (.svg, .png) show coordinates against time, with velocity and acceleration; a .gif shows the
    linkage move.
    """
    from kinfmu.log import read

    suffix = suffix_of(output)
    if columns is not None and suffix not in WITH_COLUMNS:
        raise click.UsageError(f"--columns {columns}: is for tables and plots, {listed(WITH_COLUMNS)}, not {suffix}")
    FORMATS[suffix](_between(read(run), start, stop), output, names_in(columns) or ())
    click.echo(f"written: {output}")
