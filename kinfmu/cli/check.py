"""kinfmu check: what a good colleague would say about a mechanism."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import MECHANISM, SETTING
from kinfmu.cli.group import about, main
from kinfmu.cli.settings import with_parameters
from kinfmu.errors import KinfmuError, listed

if TYPE_CHECKING:
    from kinfmu.analysis import Assemblies, Report

FIGURES = (".svg", ".png")


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option("--json", "as_json", is_flag=True, help="Findings for programs.")
@click.option("--matrices", is_flag=True, help="Jacobians at the start pose and singular points.")
@click.option("--assemblies", is_flag=True, help="The ways of putting it together, and how to choose one.")
@click.option(
    "--figure",
    "picture",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Draw the mechanism with names: .svg or .png.",
)
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank=40mm.")
def check(
    mechanism: str,
    as_json: bool,
    matrices: bool,
    assemblies: bool,
    picture: Path | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Mobility, redundant and contradicting constraints, drivers, plan, ranges and singular points."""
    from kinfmu.analysis import check as checked

    if picture is not None and picture.suffix.lower() not in FIGURES:
        raise click.UsageError(f"--figure {picture}: a figure ends in one of {listed(FIGURES)}")
    mech = with_parameters(mechanism, settings)
    with about(mechanism):
        report = checked(mech)
    if as_json:
        findings = report.as_json()
        if matrices and report.problem is None:
            findings["matrices"] = [matrix.as_json() for matrix in report.matrices()]
        if assemblies:
            found = _assemblies(report)
            findings["assemblies"] = None if found is None else found.as_json()
        click.echo(json.dumps(findings, indent=2))
    else:
        click.echo(str(report))
        if assemblies and (found := _assemblies(report)) is not None:
            click.echo(str(found))
        if matrices and report.problem is None:
            for matrix in report.matrices():
                click.echo(f"\n{matrix}")
    with about(mechanism):
        if picture is not None:
            from kinfmu.draw import figure

            figure(mech, picture)
            if not as_json:
                click.echo(f"  figure      {picture}")
        if report.problem is not None:
            raise report.problem


def _assemblies(report: Report) -> Assemblies | None:
    """The ways of putting a mechanism together; None where its problem, told at the end, leaves none."""
    try:
        return report.assemblies()
    except KinfmuError:
        if report.problem is None:
            raise
        return None
