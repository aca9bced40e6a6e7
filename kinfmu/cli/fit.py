"""kinfmu fit: find parameters with which a mechanism does what its targets ask."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu.cli.arguments import InputFile, OutputFile
from kinfmu.cli.check import FIGURES
from kinfmu.cli.group import main, on_interrupt
from kinfmu.cli.messages import Progress, warn
from kinfmu.errors import KinfmuError


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
    """Find parameters with which a mechanism does what its targets ask.

    FILE names a mechanism, bounds of its parameters, and targets: a path through points, a function, poses of a body,
    or values of measures. Errors of the targets, constraints, and all local optima found are printed.
    """
    from kinfmu.design.fit import fit as fitted
    from kinfmu.design.fit.fit_file import mechanism_file
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
