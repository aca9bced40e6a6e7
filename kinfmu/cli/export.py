"""kinfmu export: a run as a file for other programs, the kind chosen by the file's ending."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.group import main
from kinfmu.errors import listed

if TYPE_CHECKING:
    from kinfmu.run import Run


def _table(run: Run, path: Path) -> None:
    from kinfmu.log import write_table

    write_table(run, path)


FORMATS: dict[str, Callable[[Run, Path], None]] = {".csv": _table, ".parquet": _table, ".npz": _table}


@main.command()
@click.argument("run", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "-o", "output", type=click.Path(dir_okay=False, path_type=Path), required=True, help=f"{listed(FORMATS)}."
)
def export(run: Path, output: Path) -> None:
    """Write RUN (.mcap) as a table; Parquet and npz hold the units too."""
    from kinfmu.log import read

    suffix = output.suffix.lower()
    if suffix not in FORMATS:
        raise click.UsageError(f"-o {output}: nothing is exported as '{suffix}'; endings: {listed(FORMATS)}")
    FORMATS[suffix](read(run), output)
    click.echo(f"written: {output}")
