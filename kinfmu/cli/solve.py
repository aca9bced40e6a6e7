"""kinfmu solve: a run as a table, or as a record."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MECHANISM, OUTPUTS_HELP, Range, is_bare, names_in, set_option
from kinfmu.cli.files import OutputFile
from kinfmu.cli.group import about, main, stopped
from kinfmu.cli.settings import TOLERANCE, Settings, settled, tolerance_of
from kinfmu.cli.tell import note, tell_of, warn
from kinfmu.cli.verdict import fail_if_failed, verdict
from kinfmu.errors import listed
from kinfmu.files.whole_file import suffix_of
from kinfmu.units import Quantity, in_turns, looks_like_degrees

if TYPE_CHECKING:
    from kinfmu.drivers import Driver

TABLES = (".csv", ".parquet", ".npz")
RECORD = ".mcap"
HALF_TURN = math.pi  # [rad]; a longer step between samples is probably a turn that was not meant


@main.command(epilog="Example: kinfmu solve fourbar -o run.csv --angle 0deg:360deg:361")
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option(
    "-o",
    "output",
    type=OutputFile(*TABLES, RECORD),
    required=True,
    help=f"The table to write: {listed(TABLES)}; or the record, {RECORD}, which review shows and export plots.",
)
@click.option(
    "--times",
    type=Range(Quantity("time"), "STEP"),
    help="Times from A to B, such as 0:2:0.01 [s] or 0s:2s:10ms, at which the laws of the file drive; "
    "the file's run if nothing is said.",
)
@click.option(
    "--angle",
    "--position",
    "angle",
    metavar="A:B:N",
    help="N values of the driver from A to B in place of times, such as 0deg:360deg:361 or 0mm:50mm:101; bare numbers "
    "are rad, or the file's unit of length. Rates are derivatives by the driver; time counts the samples.",
)
@click.option("--wrap", is_flag=True, help="Follow --angle the short way: no step is more than half a turn.")
@click.option("--outputs", metavar="NAMES", help=f"{OUTPUTS_HELP}; what they do not need is not solved.")
@click.option(
    "--engine",
    type=click.Choice(["auto", "python", "native"]),
    default="auto",
    show_default=True,
    help="native: generated C, compiled first, for long sweeps; auto chooses by the number of samples.",
)
@set_option
@stopped("stopped before the run was whole: nothing was written")
def solve(
    mechanism: str,
    output: Path,
    times: tuple[float, float, float] | None,
    angle: str | None,
    wrap: bool,
    settings: tuple[tuple[str, str], ...],
    outputs: str | None,
    engine: str,
) -> None:
    """Solve a mechanism at times or driver values, into a table or a record.

    The table has a row for each sample: positions, velocities and accelerations of all outputs, status and error
    estimates. A record (.mcap) holds the mechanism too, for review and export.
    """
    from kinfmu.log import write_mcap, write_table
    from kinfmu.mechanism import RunSettings
    from kinfmu.sweep import run_times
    from kinfmu.sweep import solve as solved

    if times and angle:
        raise click.UsageError("--times and --angle cannot both drive")
    if wrap and not angle:
        raise click.UsageError("--wrap follows --angle the short way, which is not given")
    mech = gallery.load(mechanism)
    given = settled(mechanism, mech, settings, (TOLERANCE,))
    t, samples = None, {}
    if angle:
        _check_one_driver(mechanism, given)
        samples = _driver_values(angle, mech.drivers[0], mech.length_unit, wrap)
    else:
        t = run_times(RunSettings(*times)) if times else None
        _warn_of_external(mech.drivers)
    with about(mechanism):
        run = solved(
            mech,
            t,
            parameters={**given.parameters, **given.constants},
            outputs=names_in(outputs),
            engine=engine,
            wrap=wrap,
            tolerance=tolerance_of(given),
            **samples,
        )
    if suffix_of(output) == RECORD:
        write_mcap(run, output)
    else:
        write_table(run, output)
    tell_of(run)
    click.echo(f"{verdict(run)}; written to {output}")
    fail_if_failed(run, by_samples=angle is not None)


def _check_one_driver(name: str, given: Settings) -> None:
    """UsageError if --angle cannot drive the mechanism of that name alone, or --set changes the law it replaces."""
    drivers = given.written.drivers
    if len(drivers) != 1:
        names = listed(driver.name for driver in drivers)
        raise click.UsageError(f"--angle drives one driver, {name} has {names}; simulate --input drives them")
    for constant in given.constants:
        raise click.UsageError(f"--set {constant} changes the law, which --angle does not use")


def _driver_values(text: str, driver: Driver, length_unit: str, wrap: bool) -> dict[str, Any]:
    """The driver's input with its values: what their units may be is known once the mechanism is read."""
    import numpy as np

    context = click.get_current_context()
    option = next(option for option in context.command.params if option.name == "angle")
    first, last, n = Range(driver.quantity, "N", length_unit).convert(text, option, context)
    if driver.quantity.kind == "angle":
        _tell_of_angles(text, first, last, int(n), wrap)
    return {driver.inputs()[0]: np.linspace(first, last, int(n))}


def _tell_of_angles(text: str, first: float, last: float, n: int, wrap: bool) -> None:
    """Say what bare numbers that look like degrees mean; warn of steps of more than half a turn."""
    a, b, _ = text.split(":")
    if is_bare(a) and is_bare(b) and (looks_like_degrees(first) or looks_like_degrees(last)):
        turns = in_turns(last - first)
        note(f"--angle {text}: {first:g} to {last:g} rad, {turns}; write {a}deg:{b}deg:{n} for degrees")
    elif n > 1 and not wrap and abs(last - first) / (n - 1) > HALF_TURN * (1.0 + 1e-9):
        step = abs(last - first) / (n - 1)
        warn(f"--angle {text}: steps of {in_turns(step)} between samples; --wrap takes each the short way")


def _warn_of_external(drivers: tuple[Driver, ...]) -> None:
    """Warn of drivers that time does not move."""
    from kinfmu.laws import External

    still = [driver.name for driver in drivers if isinstance(driver.law, External)]
    if still:
        one = len(still) == 1
        warn(
            f"{'driver' if one else 'drivers'} {listed(still)} {'has' if one else 'have'} no law, so nothing moves "
            f"{'it' if one else 'them'} by time; --angle drives a single one, simulate --input any number"
        )
