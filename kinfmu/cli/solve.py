"""kinfmu solve: solve a mechanism into a table or a record."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import (
    OutputFile,
    RangeArgument,
    driver_value,
    is_bare,
    mechanism_argument,
    names_in,
    outputs_option,
)
from kinfmu.cli.group import errors_of, main, note, on_interrupt, report, warn
from kinfmu.cli.settings import (
    CSV,
    TOLERANCE,
    XLSX,
    Settings,
    checked_settings,
    csv_form,
    has_degrees,
    set_option,
    table_options,
    tolerance_of,
)
from kinfmu.errors import listed
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery
from kinfmu.units import Quantity, in_turns, looks_like_degrees

if TYPE_CHECKING:
    from kinfmu.mechanism.drivers import Driver

TABLES = (CSV, XLSX, ".parquet", ".npz")
RECORD = ".mcap"
HALF_TURN = math.pi  # [rad]; a longer step between samples is probably a wrapped angle


@main.command(epilog="Example: kinfmu solve crank_rocker -o run.csv --angle 0deg:360deg:361")
@mechanism_argument
@click.option(
    "-o",
    "output",
    type=OutputFile(*TABLES, RECORD),
    required=True,
    help=f"The table to write: {listed(TABLES)}; or the record, {RECORD}, for review and export.",
)
@click.option(
    "--times",
    type=RangeArgument(Quantity("time"), "STEP"),
    help="Times from A to B at which the laws of the file drive, such as 0:2:0.01 [s] or 0s:2s:10ms. Default: the "
    "[run] of the file.",
)
@click.option(
    "--angle",
    "--position",
    "angle",
    metavar="A:B:N",
    help="N driver values from A to B in place of times, such as 0deg:360deg:361 or 0mm:50mm:101. Bare numbers are in "
    "rad or in the file's unit of length. Rates are derivatives by the driver, per rad or unit of length, without "
    "--speed. The table begins with the driver's values and has no time.",
)
@click.option(
    "--speed",
    metavar="VALUE",
    help="Speed of --angle, such as 60rpm or 20mm/s: rates are then per second. Bare numbers are in rad/s or in the "
    "file's unit of length per second.",
)
@click.option("--wrap", is_flag=True, help="Unwrap --angle: no step is more than half a turn.")
@outputs_option
@click.option(
    "--engine",
    type=click.Choice(["auto", "python", "native"]),
    default="auto",
    show_default=True,
    help="native: compiled C, for long sweeps; auto: chosen by the number of samples.",
)
@click.option(
    "--degrees/--radians",
    default=None,
    help="Unit of angles in a table, and of their rates in time. Default: degrees in .xlsx, else radians.",
)
@table_options
@set_option
@on_interrupt("stopped before the run was complete: nothing was written")
def solve(
    mechanism: str,
    output: Path,
    times: tuple[float, float, float] | None,
    angle: str | None,
    speed: str | None,
    wrap: bool,
    degrees: bool | None,
    settings: tuple[tuple[str, str], ...],
    outputs: str | None,
    engine: str,
    **of_table: Any,
) -> None:
    """Solve a mechanism at times or driver values.

    Writes a table with one row per sample (positions, velocities and accelerations of all outputs, status, error
    estimates) or a record (.mcap), which also contains the mechanism, for review and export.
    """
    from kinfmu.mechanism import RunSettings
    from kinfmu.run.driving import run_times
    from kinfmu.run.solve import solve as solved

    if times and angle:
        raise click.UsageError("--times and --angle exclude each other")
    for option, value in (("--wrap", wrap), (f"--speed {speed}", speed)):
        if value and not angle:
            raise click.UsageError(f"{option} needs --angle")
    form = csv_form(suffix_of(output), TABLES, of_table)
    if degrees and suffix_of(output) == RECORD:
        raise click.UsageError(f"--degrees: only for tables, {listed(TABLES)}; export writes those of a record")
    mech = gallery.load(mechanism)
    given = checked_settings(mech, settings, (TOLERANCE,))
    t, samples = None, {}
    if angle:
        _check_one_driver(mechanism, given)
        samples = _driver_values(angle, mech.drivers[0], mech.length_unit, wrap)
        if speed:
            name = mech.drivers[0].inputs()[1]
            samples[name] = driver_value("--speed", speed, name.quantity, mech.length_unit)
    else:
        t = run_times(RunSettings(*times)) if times else None
        _warn_of_external(mech.drivers)
    with errors_of(mechanism), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of degrees; --angle has a note of its own
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
        from kinfmu.log import write_mcap

        write_mcap(run, output)
    else:
        from kinfmu.log import write_table

        in_degrees = has_degrees(suffix_of(output), {"degrees": degrees})
        write_table(run, output, degrees=in_degrees, lengths=of_table["lengths"], **form)
    report(run, f"written to {output}", by_samples=angle is not None)


def _check_one_driver(name: str, given: Settings) -> None:
    """Raise a UsageError for several drivers, or if --set changes the law that --angle replaces."""
    drivers = given.written.drivers
    if len(drivers) != 1:
        names = listed(driver.name for driver in drivers)
        raise click.UsageError(f"--angle drives one driver, {name} has {names}; simulate --input drives them")
    for constant in given.constants.keys() & {one.name for one in given.written.law_constants}:
        raise click.UsageError(
            f"--set {constant} changes the law, which --angle does not use: rates are then derivatives with respect to "
            f"{drivers[0].name}; to drive by the law, give --times A:B:STEP in place of --angle"
        )


def _driver_values(text: str, driver: Driver, length_unit: str, wrap: bool) -> dict[str, Any]:
    """Return the values of the driver's input; the mechanism gives their unit."""
    import numpy as np

    context = click.get_current_context()
    option = next(option for option in context.command.params if option.name == "angle")
    first, last, n = RangeArgument(driver.quantity, "N", length_unit).convert(text, option, context)
    if driver.quantity.kind == "angle":
        _note_angles(text, first, last, int(n), wrap)
    return {driver.inputs()[0]: np.linspace(first, last, int(n))}


def _note_angles(text: str, first: float, last: float, n: int, wrap: bool) -> None:
    """Note bare numbers that look like degrees; warn of steps of more than half a turn."""
    a, b, _ = text.split(":")
    if is_bare(a) and is_bare(b) and (looks_like_degrees(first) or looks_like_degrees(last)):
        turns = in_turns(last - first)
        note(f"--angle {text}: {first:g} to {last:g} rad, {turns}; write {a}deg:{b}deg:{n} for degrees")
    elif n > 1 and not wrap and abs(last - first) / (n - 1) > HALF_TURN * (1.0 + 1e-9):
        step = abs(last - first) / (n - 1)
        warn(f"--angle {text}: steps of {in_turns(step)} between samples; --wrap unwraps them")


def _warn_of_external(drivers: tuple[Driver, ...]) -> None:
    """Warn of drivers without a law, which time does not move."""
    from kinfmu.mechanism.laws import External

    fixed = [driver.name for driver in drivers if isinstance(driver.law, External)]
    if fixed:
        one = len(fixed) == 1
        warn(
            f"{'driver' if one else 'drivers'} {listed(fixed)} {'has' if one else 'have'} no law and "
            f"{'does' if one else 'do'} not move with time; "
            "use solve --angle for one driver, simulate --input for any number"
        )
