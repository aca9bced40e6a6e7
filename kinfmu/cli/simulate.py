"""kinfmu simulate: step an FMU and write logs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import InputFile, ModelName, OutputFile, Time
from kinfmu.cli.group import Progress, errors_as, errors_of, main, on_interrupt, report
from kinfmu.cli.settings import (
    DRIVEN_BY_TIME,
    INTEGRATOR_TOLERANCE,
    RATES,
    TOLERANCE,
    as_values,
    checked_settings,
    set_option,
)
from kinfmu.files import suffix_of, temporary_folder
from kinfmu.mechanism import gallery

if TYPE_CHECKING:
    from kinfmu.run import Run, Sink

LOGS = Path("logs")


@main.command(epilog="Example: kinfmu simulate crank_rocker --stop 4 --step 0.01")
@click.argument("model", metavar="FMU|SSP|MECH", type=ModelName())
@click.option("--start", type=Time(), help="Start time [s]. Default: first row of --input, else that of the model.")
@click.option("--stop", type=Time(), help="Stop time [s]. Default: last row of --input, else that of the model.")
@click.option("--step", type=Time(), help="Communication step [s]. Default: that of the model.")
@click.option(
    "--input",
    "inputs",
    type=InputFile(),
    help="A CSV file that drives in place of the laws: columns time and inputs, such as crank_angle or "
    "'crank_angle [deg]'; linear between rows.",
)
@click.option(
    "--drive",
    type=click.Choice(["torque"]),
    help="torque: efforts such as crank_torque are inputs, 0 by default, and the motion is integrated from the state "
    "at the start, such as --set crank_speed=60rpm. For a MECH; an FMU has what it was built with.",
)
@click.option("--wrap", is_flag=True, help="Unwrap the angles of --input, such as a jump from 360 to 0 deg.")
@set_option
@click.option("--mcap", type=OutputFile(".mcap"), help="The record to write. Default: logs/<name of the file>.mcap.")
@click.option(
    "--rrd", type=OutputFile(".rrd"), help="The Rerun recording to write. Default: <record>.rrd in the same folder."
)
@click.option(
    "--channels",
    metavar="NAMES",
    help="What to log, separated by commas: q, qd, qdd, points, inputs, forces, reactions, signals, residual, "
    "iterations, margin, error, watch, drawn (for viewers), columns such as coupler.*; -error,-margin: all but these; "
    "none: no logs. Default: all.",
)
@click.option(
    "--exchange",
    type=click.Choice(["ordered", "jacobi"]),
    default="ordered",
    help="How an SSP passes values: ordered, an output after the inputs that it depends on; jacobi, all at once, a "
    "step late, as many hosts do. Default: ordered.",
)
@click.option("--live", is_flag=True, help="Show the run in the Rerun viewer while it is computed.")
@click.option("--rate", type=click.FloatRange(min=0.0, min_open=True), help="Samples to log per second of the run.")
@on_interrupt("stopped before the first sample: nothing was kept")
def simulate(
    model: str,
    start: float | None,
    stop: float | None,
    step: float | None,
    inputs: Path | None,
    drive: Any,
    wrap: bool,
    settings: tuple[tuple[str, str], ...],
    mcap: Path | None,
    rrd: Path | None,
    channels: str | None,
    exchange: str,
    live: bool,
    rate: float | None,
) -> None:
    """Step an FMU or an SSP and write logs.

    Steps an FMU with fmpy, of kinfmu, built from a MECH first, or of another tool, or the connected FMUs of an SSP, and
    writes an MCAP record and, with the extra viewer, a Rerun recording. The record grows during the run; kinfmu recover
    restores that of a killed run.
    """
    from kinfmu.fmu import simulate as simulated
    from kinfmu.log.viewer.package import INSTALL, has_viewer, require_viewer, without_pandas

    if wrap and inputs is None:
        raise click.UsageError("--wrap needs --input")
    names = None if channels is None else [name.strip() for name in channels.split(",")]
    is_logged = names != ["none"]
    for path in (mcap, rrd):
        if path is not None and not is_logged:
            raise click.UsageError(f"--channels none leaves nothing to write to {path}")
    if rrd is not None:
        require_viewer(f"{rrd}: a recording")
    if live:
        require_viewer("--live")
    with temporary_folder() as folder:
        fmu, parameters = _fmu(model, settings, folder, drive, has_inputs=inputs is not None)
        record, recording = _logs(model, mcap, rrd) if is_logged else (None, None)
        has_recording = rrd is not None or has_viewer()
        is_replaced = record is not None and record.exists()
        sinks: list[Sink] = []
        if record:
            from kinfmu.log import McapLog
            from kinfmu.run.channels import is_drawn

            sinks.append(McapLog(record, drawn=is_drawn(names)))
        if live:
            from kinfmu.log import LiveView

            sinks.append(LiveView())
        with Progress() as progress, errors_as(str(fmu), model):
            run = simulated(
                fmu,
                drive=drive,
                start=start,
                stop=stop,
                step=step,
                inputs=inputs,
                parameters=parameters,
                wrap=wrap,
                channels=names,
                rate=rate,
                sink=_Sinks(*sinks) if sinks else None,
                progress=progress,
                exchange=exchange,
            )
    if recording and has_recording:
        with on_interrupt(f"stopped before the recording was written; the run is in {record}"), without_pandas():
            from kinfmu.log import write_rrd

            write_rrd(run, recording)
    replaced = " (an older run of that name was replaced)" if is_replaced else ""
    files, review = f"{record} and {recording}", f"to review it: kinfmu review {quote(str(record))}"
    if recording and not has_recording:
        older = f"; {recording} is of an older run" if recording.exists() else ""
        files, review = f"{record}", f"no recording, which needs the Rerun viewer: {INSTALL}{older}"
    report(run, *((f"written to {files}{replaced}", review) if record else ()))


class _Sinks:
    """Several sinks as one."""

    def __init__(self, *sinks: Sink) -> None:
        self._sinks = sinks

    def begin(self, run: Run) -> None:
        for sink in self._sinks:
            sink.begin(run)

    def add(self, run: Run) -> None:
        for sink in self._sinks:
            sink.add(run)

    def end(self, run: Run, reason: str) -> None:
        for sink in self._sinks:
            sink.end(run, reason)


def _fmu(
    model: str, settings: Sequence[tuple[str, str]], folder: Path, drive: Any, *, has_inputs: bool
) -> tuple[Path, dict[str, float | str | bool]]:
    """Return the FMU, built in `folder` if `model` is a mechanism, and the parameters to set in it."""
    from kinfmu.fmu import build
    from kinfmu.fmu.build import default_drive

    if suffix_of(model) in (".fmu", ".ssp"):
        return Path(model), as_values(settings)
    mech = gallery.load(model)
    states = [name for driver in mech.drivers for name in driver.inputs()[:2]]
    of_run = (TOLERANCE, DRIVEN_BY_TIME, RATES) if drive is None else (TOLERANCE, INTEGRATOR_TOLERANCE, *states)
    given = checked_settings(mech, settings, of_run)
    with errors_of(model):
        mech = given.mechanism()
        has_load_inputs = any(load.inputs() for load in mech.loads)  # a table may give these alone
        by_inputs = has_inputs and not has_load_inputs
        chosen = drive or ("inputs" if by_inputs else default_drive(mech))
        flavour = "native" if drive else "python"  # compiling takes longer than a run, but for an integrator's steps
        fmu = build(mech, folder, flavour=flavour, drive=chosen)
    return fmu, dict(given.of_run)


def _logs(model: str, mcap: Path | None, rrd: Path | None) -> tuple[Path, Path]:
    """Return the paths of record and recording; default: logs/ and the name of the file or of the gallery's mechanism.

    The recording has the path of the record with the ending .rrd, so that two runs of one mechanism keep all files.
    """
    file = Path(model.replace(":", "_"))
    name = file.stem if suffix_of(file) in (".toml", ".fmu", ".ssp") else file.name
    record = mcap or LOGS / f"{name}.mcap"
    return record, rrd or record.with_suffix(".rrd")
