"""kinfmu simulate: an FMU stepped, its run logged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from shlex import quote

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MODEL, TIME, set_option
from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import about, instead, main, stopped
from kinfmu.cli.progress import Progress
from kinfmu.cli.settings import DRIVEN_BY_TIME, RATES, TOLERANCE, as_values, settled
from kinfmu.cli.tell import tell_of
from kinfmu.cli.verdict import fail_if_failed, verdict
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.files.whole_file import suffix_of

LOGS = Path("logs")


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
@click.option(
    "--mcap", type=OutputFile(".mcap"), help="The record to write; logs/<file given>.mcap if nothing is said."
)
@click.option(
    "--rrd", type=OutputFile(".rrd"), help="The Rerun recording to write; beside the record if nothing is said."
)
@click.option(
    "--channels",
    metavar="NAMES",
    help="What to keep, with commas: q, qd, qdd, points, inputs, residual, iterations, margin, error, watch, columns "
    "such as coupler.* and drawn, for viewers; -error,-margin: all but those; none: no logs. All if nothing is said.",
)
@click.option("--rate", type=click.FloatRange(min=0.0, min_open=True), help="Samples to keep in a second of the run.")
@stopped("stopped before the first sample: nothing was kept")
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
    channels: str | None,
    rate: float | None,
) -> None:
    """Step an FMU and log the run; of a MECH it is built first.

    Steps an FMU that kinfmu built, with fmpy, and writes an MCAP record and a Rerun recording. The record grows with
    the run: of one that is killed, kinfmu recover keeps all but the last moment.
    """
    from tempfile import TemporaryDirectory

    from kinfmu.fmu import simulate as simulated
    from kinfmu.log import McapLog, write_rrd
    from kinfmu.run.channels import is_drawn

    if wrap and inputs is None:
        raise click.UsageError("--wrap follows the angles of --input, which is not given")
    names = None if channels is None else [name.strip() for name in channels.split(",")]
    is_logged = names != ["none"]
    for path in (mcap, rrd):
        if path is not None and not is_logged:
            raise click.UsageError(f"--channels none keeps nothing to write to {path}")
    with TemporaryDirectory(prefix="kinfmu_") as folder:
        fmu, parameters = _fmu(model, settings, Path(folder), has_inputs=inputs is not None)
        record, recording = _logs(model, mcap, rrd) if is_logged else (None, None)
        is_replaced = record is not None and record.exists()
        needs_room = is_logged and mcap is None
        with _room() if needs_room else nullcontext(), Progress() as progress, instead(str(fmu), model):
            run = simulated(
                fmu,
                start=start,
                stop=stop,
                step=step,
                inputs=inputs,
                parameters=parameters,
                wrap=wrap,
                channels=names,
                rate=rate,
                sink=McapLog(record, drawn=is_drawn(names)) if record else None,
                progress=progress,
            )
    if recording:
        with stopped(f"stopped before the recording was written; the run is in {record}"):
            write_rrd(run, recording)
    tell_of(run)
    replaced = " (an older run of that name was replaced)" if is_replaced else ""
    click.echo(f"{verdict(run)}; written to {record} and {recording}{replaced}" if record else verdict(run))
    if record:
        click.echo(f"to look at it: kinfmu review {quote(str(record))}")
    fail_if_failed(run)


def _fmu(
    model: str, settings: Sequence[tuple[str, str]], folder: Path, *, has_inputs: bool
) -> tuple[Path, dict[str, float | str | bool]]:
    """The FMU that is asked for, built in `folder` if a mechanism is, and the parameters to set in it."""
    from kinfmu.fmu import build
    from kinfmu.fmu.build import default_drive

    if suffix_of(model) == ".fmu":
        return Path(model), as_values(settings)
    mech = gallery.load(model)
    given = settled(model, mech, settings, (TOLERANCE, DRIVEN_BY_TIME, RATES))
    with about(model):
        mech = given.mechanism()
        drive = "inputs" if has_inputs else default_drive(mech)
        fmu = build(mech, folder, flavour="python", drive=drive)  # stepped here and now: a compiler would take longer
    return fmu, dict(given.of_run)


def _logs(model: str, mcap: Path | None, rrd: Path | None) -> tuple[Path, Path]:
    """Where the logs go: into logs/, under the name of the file or of the gallery's mechanism, if nothing is said.

    The recording goes beside the record, so that two runs of one mechanism keep both of their files.
    """
    file = Path(model.replace(":", "_"))
    name = file.stem if suffix_of(file) in (".toml", ".fmu") else file.name
    record = mcap or LOGS / f"{name}.mcap"
    return record, rrd or record.with_suffix(".rrd")


@contextmanager
def _room() -> Iterator[None]:
    """The folder of logs is there in this block; one that was made for it goes again if nothing is kept."""
    is_there = LOGS.is_dir()
    try:
        LOGS.mkdir(exist_ok=True)
    except OSError as error:
        raise KinfmuError(f"{LOGS}: cannot be made ({error.strerror})") from None
    try:
        yield
    except (RequestError, KeyboardInterrupt):
        if not is_there:
            LOGS.rmdir()
        raise
