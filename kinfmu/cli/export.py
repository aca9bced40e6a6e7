"""kinfmu export: a run as a file for other programs, the kind chosen by the file's ending."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import main
from kinfmu.errors import listed

if TYPE_CHECKING:
    from kinfmu.run import Run


def _table(run: Run, path: Path) -> None:
    from kinfmu.log import write_table

    write_table(run, path)


FORMATS: dict[str, Callable[[Run, Path], None]] = {".csv": _table, ".parquet": _table, ".npz": _table}


@main.command(epilog="Example: kinfmu export logs/fourbar.mcap -o fourbar.csv")
@click.argument("run", type=InputFile(".mcap"))
@click.option(
    "-o",
    "output",
    type=OutputFile(*FORMATS),
    required=True,
    help=f"The file to write: {listed(FORMATS)}.",
)
def export(run: Path, output: Path) -> None:
    """Write a run as a table.

    RUN is a record (.mcap) of simulate. Parquet and npz hold the units, too.
    """
    from kinfmu.log import read

    FORMATS[output.suffix.lower()](read(run), output)
    click.echo(f"written: {output}")
