"""kinfmu solve: a run as a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MECHANISM, SETTING, Range
from kinfmu.cli.group import about, main
from kinfmu.cli.settings import as_values, refuse_what_follows
from kinfmu.cli.verdict import fail_if_failed, verdict
from kinfmu.errors import listed
from kinfmu.units import Quantity

TABLES = (".csv", ".parquet", ".npz")


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option(
    "-o", "output", type=click.Path(dir_okay=False, path_type=Path), required=True, help=".csv, .parquet or .npz."
)
@click.option("--times", type=Range(Quantity("time"), "STEP"), help="Times [s]; the file's run if nothing is said.")
@click.option(
    "--angle",
    "--position",
    "angle",
    metavar="A:B:N",
    help="N values of the driver [rad, or the file's unit of length], or such as 0deg:360deg:361 or 0mm:50mm:101; "
    "rates are for a driver's speed of 1, time counts the samples.",
)
@click.option("--wrap", is_flag=True, help="Follow --angle the short way: no step is more than half a turn.")
@click.option(
    "--set", "settings", type=SETTING, multiple=True, help="A parameter or law constant, such as crank.speed=30rpm."
)
@click.option("--outputs", help="Names to solve for, with commas; all if nothing is said.")
@click.option("--engine", type=click.Choice(["auto", "python", "native"]), default="auto", show_default=True)
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
    """Solve position, velocity and acceleration at times or at driver values, into a table."""
    import numpy as np

    from kinfmu.log import write_table
    from kinfmu.mechanism import RunSettings
    from kinfmu.sweep import run_times
    from kinfmu.sweep import solve as solved

    if output.suffix.lower() not in TABLES:
        raise click.UsageError(f"-o {output}: a table ends in one of {listed(TABLES)}")
    if times and angle:
        raise click.UsageError("--times and --angle cannot both drive")
    if wrap and not angle:
        raise click.UsageError("--wrap follows --angle the short way, which is not given")
    mech = gallery.load(mechanism)
    wanted = [name.strip() for name in outputs.split(",")] if outputs else None
    refuse_what_follows(mech, settings)
    parameters = as_values(settings)
    if angle:
        if len(mech.drivers) != 1:
            raise click.UsageError(f"--angle drives one driver; this mechanism has {len(mech.drivers)}")
        t = None
        for name in (name for name in parameters if name not in mech.parameters):
            raise click.UsageError(f"--set {name} changes the law, which --angle does not use")
        first, last, count = _driver_values(angle, mech.drivers[0].quantity, mech.length_unit)
        samples: dict[str, Any] = {mech.drivers[0].inputs()[0]: np.linspace(first, last, int(count))}
    else:
        t, samples = (run_times(RunSettings(*times)) if times else None), {}
    with about(mechanism):
        run = solved(mech, t, parameters=parameters, outputs=wanted, engine=engine, wrap=wrap, **samples)
    write_table(run, output)
    click.echo(f"{verdict(run)}; written to {output}")
    fail_if_failed(run, by_samples=angle is not None)


def _driver_values(text: str, quantity: Quantity, length_unit: str) -> tuple[float, float, float]:
    """First, last and number of a driver's values: what their units may be is known once the mechanism is read."""
    context = click.get_current_context()
    option = next(option for option in context.command.params if option.name == "angle")
    return Range(quantity, "N", length_unit).convert(text, option, context)
