"""kinfmu verify: check a host by the reference results in an FMU."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from kinfmu.cli.arguments import InputFile, names_in
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError


@main.command(epilog="Example: kinfmu verify crank_rocker.fmu --results host.csv")
@click.argument("fmu", type=InputFile(".fmu"), metavar="FMU")
@click.option(
    "--results",
    type=InputFile(),
    help="Results of a host, as CSV: a column time, and outputs by name. Default: step the FMU with fmpy.",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0.0, min_open=True, max=1.0, max_open=True),
    help="Largest valid difference, relative to the largest number with the same unit; 1e-5 for hosts that write six "
    "digits. Default: that in the FMU: 1e-9, larger near singular points.",
)
@click.option(
    "--columns",
    metavar="NAMES",
    help="Only these outputs, such as crank.phi,'ram.*', with * for any letters. Default: all.",
)
def verify(fmu: Path, results: Path | None, tolerance: float | None, columns: str | None) -> None:
    """Check a host by the reference results in an FMU.

    An FMU of kinfmu holds the outputs at about 20 samples, in extra/org.kinfmu, with the step that belongs to them. An
    FMU that torques drive has none.
    """
    from kinfmu.fmu import verify as verified

    found = verified(fmu, results, tolerance=tolerance, columns=names_in(columns))
    click.echo(str(found))
    if not found.ok:
        missing = found.missing and not found.is_shorter
        if found.left_out and found.difference <= found.tolerance and not missing:
            raise KinfmuError(
                f"{results or fmu}: {len(found.left_out)} of {len(found.left_out) + len(found.names)} outputs are not "
                f"in the results; to compare only some, name them: --columns {quote(','.join(found.names[:3]))}"
            )
        if len(found.missing) == found.samples or found.difference <= found.tolerance:
            raise KinfmuError(
                f"{results or fmu}: {len(found.missing)} of {found.samples} samples of the reference are missing"
            )
        raise KinfmuError(f"{results or fmu}: the results are not those of the reference")
