"""kinfmu fit: find parameters with which a mechanism does what its targets ask; kinfmu study: measure many designs."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import Any

import click

from kinfmu.cli.arguments import InputFile, OutputFile, names_in
from kinfmu.cli.check import FIGURES
from kinfmu.cli.group import Progress, main, note, on_interrupt, warn
from kinfmu.cli.settings import CSV, XLSX, csv_form, table_options
from kinfmu.errors import KinfmuError
from kinfmu.files import suffix_of


@main.command(epilog="Example: kinfmu fit curve.toml -o fitted.toml --figure fitted.svg")
@click.argument("file", type=InputFile(".toml"), metavar="FILE")
@click.option("-o", "output", type=OutputFile(".toml"), help="Write the mechanism found: a mechanism file, .toml.")
@click.option(
    "--figure", "picture", type=OutputFile(*FIGURES), help="Draw what is wanted and reached: .svg, .png or .pdf."
)
@click.option("--starts", type=click.IntRange(1), default=16, show_default=True, help="Number of whole searches.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the start points.")
@click.option("--workers", type=click.IntRange(1), help="Number of processes. Default: one for each core.")
@on_interrupt("interrupted; nothing is written")
def fit(file: Path, output: Path | None, picture: Path | None, starts: int, seed: int, workers: int | None) -> None:
    """Find the parameters with which a mechanism does its task.

    FILE names a mechanism, bounds of its parameters, and targets: a path through points, a function, poses of a body,
    or values of measures. Errors of the targets, constraints, and all local optima found are printed.
    """
    from kinfmu.design.fit import fit as fitted
    from kinfmu.design.fit.problem import mechanism_file
    from kinfmu.mechanism.gallery import save

    if output is not None:
        for own, what in ((file, "the fit file"), (mechanism_file(file), "its mechanism")):
            if own is not None and own.exists() and output.exists() and output.samefile(own):
                raise click.UsageError(f"-o {output} would replace {what}; choose another name")

    with Progress("fitting", 1) as show:
        result = fitted(file, starts=starts, seed=seed, workers=workers, progress=show)
    click.echo(str(result))
    if result.note:
        warn(result.note)
    if output is not None:
        save(result.mechanism, output)
        click.echo(f"\nmechanism   {output}")
    if picture is not None:
        result.figure(picture)
        click.echo(f"figure      {picture}")
    if not result.holds:
        broken = ", ".join(one.name for one in result.constraints if not one.holds)
        raise KinfmuError(f"{file}: the best design does not meet all constraints: {broken}")


@main.command(epilog="Example: kinfmu study tolerances.toml --figure tolerances.svg")
@click.argument("file", type=InputFile(".toml"))
@click.option(
    "-o",
    "output",
    type=OutputFile(".parquet", ".csv"),
    help="The results, .parquet or .csv. Default: the name of FILE in the current folder, with .parquet if pyarrow is "
    "installed, else with .csv.",
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
@click.option(
    "--restart",
    is_flag=True,
    help="Begin again: replace the results and the parts that an earlier run or another study left.",
)
@click.option("--figure", "picture", type=OutputFile(*FIGURES), help="Draw the results into a .svg, .png or .pdf file.")
@click.option("--measures", metavar="NAMES", help="Only these measures in the figure, such as stroke,swing.")
@click.option(
    "--table",
    type=OutputFile(CSV, XLSX),
    help="Also write the results for a spreadsheet, .xlsx or .csv, in the units of the summary.",
)
@click.option(
    "--recordings",
    metavar="FOLDER",
    type=click.Path(path_type=Path, file_okay=False),
    help="Also record designs, at most 24, for the Rerun viewer: kinfmu review FOLDER compares them.",
)
@table_options
def study(
    file: Path,
    output: Path | None,
    workers: int | None,
    dask: str | None,
    engine: str,
    restart: bool,
    picture: Path | None,
    measures: str | None,
    table: Path | None,
    recordings: Path | None,
    **of_table: Any,
) -> None:
    """Measure many designs of a mechanism.

    FILE names a mechanism and how its parameters vary: on a grid, in ranges, or with tolerances (docs/studies.md).
    Prints a summary and writes a table with a row for each design. A study that was ended goes on where it was when the
    same command is given again.
    """
    from kinfmu.design.study import read_study, run_study
    from kinfmu.design.study.parts import folder_of

    if table is None and any(of_table.values()):
        raise click.UsageError("--lengths, --units, --separator and --decimal need --table")
    form = csv_form(suffix_of(table or CSV), (CSV, XLSX), of_table)
    if workers is not None and dask not in (None, "local"):
        raise click.UsageError("--workers is for this machine; the Dask cluster has its own")
    defined = read_study(file, engine=engine)
    for text in defined.notes:
        note(text)
    target = output or Path(f"{file.stem}{'.parquet' if find_spec('pyarrow') else '.csv'}")
    designs = _Designs()
    try:
        with Progress(f"kinfmu study {quote(str(file))}", least=1) as show:
            result = run_study(
                defined,
                target,
                workers=workers,
                dask=dask,
                restart=restart,
                progress=lambda done, count: show(*designs.of_this_call(done, count)),
            )
    except KeyboardInterrupt:
        raise KinfmuError(f"stopped; {designs.kept_in(folder_of(target))}") from None
    except SystemExit:  # a signal
        note(designs.kept_in(folder_of(target)))
        raise
    click.echo(str(result))
    click.echo(f"\nresults: {target}")
    if table is not None:
        from kinfmu.log.table import write_sheet
        from kinfmu.run.tables import in_lengths

        own = result.mechanism.length_unit
        write_sheet([in_lengths(one, own, of_table["lengths"]) for one in result.shown_columns()], table, **form)
        click.echo(f"table: {table}")
    if recordings is not None:
        from kinfmu.design.study.recordings import write_recordings
        from kinfmu.log.viewer.package import without_pandas

        with without_pandas():
            count = len(write_recordings(defined, result, recordings))
        click.echo(
            f"recordings of {count} designs: {recordings}; to compare them: kinfmu review {quote(str(recordings))}"
        )
    if picture is not None:
        result.figure(picture, tuple(names_in(measures) or ()))
        click.echo(f"figure: {picture}")


class _Designs:
    """The designs that are done, of all, and those that an earlier call left."""

    def __init__(self) -> None:
        self.done = self.count = 0
        self._before = 0

    def of_this_call(self, done: int, count: int) -> tuple[int, int]:
        """Note how many designs are done; return how many of this call are, and how many it measures."""
        if not self.count:
            self._before = done
        self.done, self.count = done, count
        return done - self._before, count - self._before

    def kept_in(self, folder: Path) -> str:
        """Return the note on an interrupted study."""
        return f"{self.done} of {self.count} designs are kept in {folder}: the same command goes on from there"
