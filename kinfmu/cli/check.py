"""kinfmu check: report the properties and problems of a mechanism."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import InputFile, OutputFile, driver_value, mechanism_argument
from kinfmu.cli.group import errors_of, main
from kinfmu.cli.settings import checked_settings, set_option, tolerances_of_study, without_tolerances
from kinfmu.errors import KinfmuError, MechanismError, listed
from kinfmu.mechanism import gallery
from kinfmu.mechanism.body import MEASURED_OVER

if TYPE_CHECKING:
    from kinfmu.analysis import Assemblies, Report
    from kinfmu.mechanism import Mechanism

FIGURES = (".svg", ".png", ".pdf")
COLUMNS, MOST_COLUMNS = 80, 120  # of a report in a file, and on a wide terminal


@main.command(epilog="Example: kinfmu check crank_rocker --figure crank_rocker.svg")
@mechanism_argument
@click.option("--detail", is_flag=True, help="All digits, coordinates, fixed values, solving order, determinants.")
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON, for programs.")
@click.option("--matrices", is_flag=True, help="Also print the Jacobians at the assembled pose and at singular points.")
@click.option(
    "--certify", "is_certified", is_flag=True, help="Prove the motion between samples, by interval arithmetic."
)
@click.option(
    "--certificate", "proof", type=OutputFile(".json"), help="Certify, and write the proof for kinfmu verify: .json."
)
@click.option(
    "--tolerances",
    "study",
    type=InputFile(".toml"),
    help="Study file: the certificate holds for all its tolerances; also --set crank=20mm+-0.05mm.",
)
@click.option("--assemblies", is_flag=True, help="List the ways to assemble the mechanism, and how to choose one.")
@click.option(
    "--figure", "picture", type=OutputFile(*FIGURES), help="Draw the mechanism with its names: .svg, .png or .pdf."
)
@click.option("--at", metavar="VALUE", help="Driver value of the pose that --figure draws, such as 45deg or 20mm.")
@click.option("--over", type=click.Choice(MEASURED_OVER), help="Motion of measures and forces; default: as in [run].")
@set_option
def check(
    mechanism: str,
    detail: bool,
    as_json: bool,
    matrices: bool,
    assemblies: bool,
    is_certified: bool,
    proof: Path | None,
    study: Path | None,
    picture: Path | None,
    at: str | None,
    over: str | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Check a mechanism and report its properties.

    First verdicts (ok, note, poor, problem) on mobility, redundant constraints, ranges of the drivers, singular poses
    and transmission angles; then tables of loops, transmission angles, cams, measures and, with masses or loads,
    forces.
    """
    from kinfmu.analysis import certify as certified
    from kinfmu.analysis import check as checked

    try:
        loaded = gallery.load(mechanism)
    except MechanismError as problem:
        if not settings:
            _print_part(mechanism, problem, detail=detail, as_json=as_json)
        raise
    plain: Sequence[tuple[str, str]] = settings
    tolerances: dict[str, float] = {}
    if is_certified or proof:
        plain, tolerances = without_tolerances(loaded, settings)
    elif study:
        raise click.UsageError("--tolerances needs --certify")
    if study:
        own, of_study = tolerances_of_study(loaded, study)
        plain, tolerances = [*own, *plain], of_study | tolerances
    mech = checked_settings(loaded, plain).mechanism()
    if over is not None:
        mech = replace(mech, run=replace(mech.run, over=over))
    value = _value(mech, mechanism, at, picture)
    with errors_of(mechanism):
        report = checked(mech, written=loaded)
    certificate = None
    if (is_certified or proof) and report.problem is None:
        with errors_of(mechanism):
            certificate = certified(mech, tolerances=tolerances or None)
        if proof:
            certificate.write(proof)
    if as_json:
        findings = report.as_json()
        if matrices and (report.problem is None or report.has_cut_cam):
            findings["matrices"] = [matrix.as_json() for matrix in report.matrices()]
        if assemblies:
            found = _assemblies(report)
            findings["assemblies"] = None if found is None else found.as_json()
        if certificate is not None:
            findings["certificate"] = certificate.as_json()
        click.echo(json.dumps(findings, indent=2))
    else:
        _print(report, detail=detail)
        if certificate is not None:
            click.echo(f"\n{_fitted(str(certificate))}")
        if assemblies and (found := _assemblies(report)) is not None:
            click.echo(f"\n{_fitted(str(found))}")
        if matrices and (report.problem is None or report.has_cut_cam):
            for matrix in report.matrices():
                click.echo(f"\n{matrix}")
    with errors_of(mechanism):
        if picture is not None:
            from kinfmu.draw import figure

            figure(mech, picture, value)
            if not as_json:
                click.echo(f"{picture}: written")
        if report.problem is not None:
            raise report.problem if as_json else _shown(report.problem)
    if sys.stdout.isatty() and not (detail or as_json):
        hint = f"kinfmu play {quote(mechanism)} moves it; --detail shows how it is solved"
        click.echo(f"\n{_fitted(hint, indent=0)}")


def _print_part(path: str, problem: MechanismError, *, detail: bool, as_json: bool) -> None:
    """Print what can be found of an invalid mechanism file; nothing if its bodies or joints are invalid."""
    from kinfmu.analysis import check as checked
    from kinfmu.analysis.report import leaving_out
    from kinfmu.mechanism.toml_file import read_partially

    part = read_partially(path)
    if part is None:
        return
    try:
        report = checked(part.mechanism)
    except KinfmuError:  # the file's own problem is reported
        return
    reason = type(problem)(str(problem).removeprefix(f"{path}: "), **problem.data)
    lacks_driver = any(name.startswith("[drivers") for name in part.left_out)  # then none is missing in the file
    if lacks_driver:
        report = replace(report, mismatch=None, advice=())
    report = leaving_out(replace(report, notes=()), reason, part.left_out)
    if as_json:
        click.echo(json.dumps(report.as_json(), indent=2))
    else:
        _print(report, detail=detail)
        raise _shown(problem)


def _print(report: Report, *, detail: bool) -> None:
    """Print a report in the width of the terminal; in colours on one, unless NO_COLOR is set."""
    is_terminal = sys.stdout.isatty()
    text = report.summary(detail=detail).text(_width(), colour=is_terminal and not os.environ.get("NO_COLOR"))
    click.echo(text, color=is_terminal)


def _width() -> int:
    """Return the letters of a line on the terminal, or in a file."""
    return min(shutil.get_terminal_size().columns, MOST_COLUMNS) if sys.stdout.isatty() else COLUMNS


def _fitted(text: str, indent: int = 14) -> str:
    """Return text as lines that fit on the terminal, with what continues a line indented; as it is in a file."""
    from kinfmu.display import wrapped

    if not sys.stdout.isatty():
        return text
    return "\n".join(part for line in text.split("\n") for part in wrapped(line, _width(), " " * indent))


def _shown(problem: KinfmuError) -> Exception:
    """Return the problem of a printed report; only the exit status if its message would follow the report."""
    with suppress(OSError, ValueError):
        out, err = os.fstat(sys.stdout.fileno()), os.fstat(sys.stderr.fileno())
        if out.st_ino and os.path.samestat(out, err):
            return click.exceptions.Exit(1)
    return problem


def _assemblies(report: Report) -> Assemblies | None:
    """Return the ways to assemble a mechanism; None where its problem, which is reported last, leaves none."""
    try:
        return report.assemblies()
    except KinfmuError:
        if report.problem is None:
            raise
        return None


def _value(mechanism: Mechanism, name: str, at: str | None, picture: Path | None) -> float | None:
    """Return the value of --at [rad or length]; raise a UsageError without --figure or with several drivers."""
    if at is None:
        return None
    if picture is None:
        raise click.UsageError(f"--at {at} needs --figure")
    if len(mechanism.drivers) != 1:
        names = listed(driver.name for driver in mechanism.drivers)
        raise click.UsageError(f"--at {at} is the value of one driver; {name} has {names}")
    (driver,) = mechanism.drivers
    return driver_value("--at", at, driver.quantity, mechanism.length_unit)
