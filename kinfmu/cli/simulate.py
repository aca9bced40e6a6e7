"""kinfmu simulate: an FMU stepped, its run logged."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MECHANISM, SETTING, TIME, exists
from kinfmu.cli.group import about, instead, main
from kinfmu.cli.progress import Progress
from kinfmu.cli.settings import as_values, refuse_what_follows
from kinfmu.cli.verdict import fail_if_failed, verdict
from kinfmu.errors import KinfmuError


@main.command()
@click.argument("model", metavar="FMU|MECH")
@click.option("--start", type=TIME, help="[s]; from the model if nothing is said, like stop and step.")
@click.option("--stop", type=TIME, help="[s]")
@click.option("--step", type=TIME, help="Communication step [s].")
@click.option(
    "--input",
    "inputs",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="CSV with columns time and inputs, such as crank_angle or crank_angle [deg].",
)
@click.option(
    "--wrap", is_flag=True, help="Angles of --input were wrapped, from 360 to 0 deg, say: follow them the short way."
)
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank.speed=30rpm.")
@click.option(
    "--mcap", type=click.Path(dir_okay=False, path_type=Path), help="Record; logs/<name>.mcap if nothing is said."
)
@click.option(
    "--rrd",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Rerun recording; logs/<name>.rrd if nothing is said.",
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
    """Step an FMU with fmpy (a mechanism is built first), and log the run to MCAP and Rerun."""
    from tempfile import TemporaryDirectory

    from kinfmu.fmu import build as built
    from kinfmu.fmu import simulate as simulated
    from kinfmu.log import write_mcap, write_rrd

    for path, suffix in ((mcap, ".mcap"), (rrd, ".rrd")):
        if path is not None and path.suffix.lower() != suffix:
            raise click.UsageError(f"--{suffix[1:]} {path}: such a file ends in {suffix}")
    if wrap and inputs is None:
        raise click.UsageError("--wrap follows the angles of --input, which is not given")
    parameters = as_values(settings)
    with TemporaryDirectory(prefix="kinfmu_") as folder:
        fmu = Path(model)
        if fmu.suffix != ".fmu":
            mech = gallery.load(MECHANISM.convert(model, None, None))
            with about(model):
                refuse_what_follows(mech, settings)
                geometry = {name: value for name, value in parameters.items() if name in mech.parameters}
                mech = mech.with_parameters(geometry)
                parameters = {name: value for name, value in parameters.items() if name not in geometry}
                fmu = built(mech, Path(folder), drive="inputs" if inputs else "time")
        elif not exists(fmu):
            raise click.UsageError(f"{fmu}: there is no such file")
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
    click.echo(f"{verdict(run)}; written to {record} and {recording}")
    click.echo(f"to look at it: kinfmu review {record}")
    fail_if_failed(run)
