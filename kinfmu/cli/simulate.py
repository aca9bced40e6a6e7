"""kinfmu simulate: an FMU stepped, its run logged."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MODEL, TIME, set_option
from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import about, instead, main
from kinfmu.cli.progress import Progress
from kinfmu.cli.settings import DRIVEN_BY_TIME, TOLERANCE, as_values, settled
from kinfmu.cli.tell import tell_of
from kinfmu.cli.verdict import fail_if_failed, verdict
from kinfmu.errors import KinfmuError


@main.command(epilog="Example: kinfmu simulate fourbar --stop 90 --step 0.5")
@click.argument("model", metavar="FMU|MECH", type=MODEL)
@click.option("--start", type=TIME, help="When it starts [s]; if nothing is said with --input, else as the model says.")
@click.option("--stop", type=TIME, help="When it ends [s]; if nothing is said with --input, else as the model says.")
@click.option("--step", type=TIME, help="Communication step [s]; if nothing is said as the model says.")
@click.option(
    "--input",
    "inputs",
    type=InputFile(),
    help="A CSV that drives in place of time: columns time and inputs, such as crank_angle or 'crank_angle [deg]'; "
    "straight from row to row.",
)
@click.option(
    "--wrap", is_flag=True, help="Angles of --input were wrapped, from 360 to 0 deg, say: follow them the short way."
)
@set_option
@click.option("--mcap", type=OutputFile(".mcap"), help="The record to write; logs/<name>.mcap if nothing is said.")
@click.option(
    "--rrd", type=OutputFile(".rrd"), help="The Rerun recording to write; logs/<name>.rrd if nothing is said."
)
def simulate(
    model: str,
    start: float | None,
    stop: float | None,
    step: float | None,
    inputs: Path | None,
    wrap: bool,
    settings: tuple[tuple[str, str], ...],
    mcap: Path | None,
    rrd: Path | None,
) -> None:
    """Step an FMU and log the run; of a MECH it is built first.

    Steps an FMU that kinfmu built, with fmpy, and writes an MCAP record and a Rerun recording.
    """
    from tempfile import TemporaryDirectory

    from kinfmu.fmu import build as built
    from kinfmu.fmu import simulate as simulated
    from kinfmu.fmu.build import default_drive
    from kinfmu.log import write_mcap, write_rrd

    if wrap and inputs is None:
        raise click.UsageError("--wrap follows the angles of --input, which is not given")
    with TemporaryDirectory(prefix="kinfmu_") as folder:
        fmu, parameters = Path(model), as_values(settings)
        if fmu.suffix != ".fmu":
            mech = gallery.load(model)
            given = settled(model, mech, settings, (TOLERANCE, DRIVEN_BY_TIME))
            parameters = {**given.constants, **given.of_run}
            with about(model):
                mech = mech.with_parameters(given.parameters)
                fmu = built(mech, Path(folder), drive="inputs" if inputs else default_drive(mech))
        with Progress() as progress, instead(str(fmu), model):
            run = simulated(
                fmu,
                start=start,
                stop=stop,
                step=step,
                inputs=inputs,
                parameters=parameters,
                wrap=wrap,
                progress=progress,
            )
    name = run.info.get("name") or fmu.stem
    logs = Path("logs")
    if mcap is None or rrd is None:
        try:
            logs.mkdir(exist_ok=True)
        except OSError as error:
            raise KinfmuError(f"{logs}: cannot be made ({error.strerror})") from None
    record, recording = mcap or logs / f"{name}.mcap", rrd or logs / f"{name}.rrd"
    write_mcap(run, record)
    write_rrd(run, recording)
    tell_of(run)
    click.echo(f"{verdict(run)}; written to {record} and {recording}")
    click.echo(f"to look at it: kinfmu review {record}")
    fail_if_failed(run)
