"""kinfmu review: show runs in the Rerun viewer; kinfmu recover: the samples of a killed run as a complete record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import InputFile, OutputFile, on_axis
from kinfmu.cli.group import main, note
from kinfmu.errors import listed

if TYPE_CHECKING:
    from kinfmu.log.viewer.timeline import Timeline


@main.command(epilog="Example: kinfmu recover logs/crank_rocker.mcap")
@click.argument("run", type=InputFile())
@click.option(
    "-o",
    "output",
    type=OutputFile(".mcap"),
    help="The record to write; default: <RUN>-recovered.mcap in the folder of RUN.",
)
def recover(run: Path, output: Path | None) -> None:
    """Write the samples of a killed run as a complete record.

    RUN is a truncated or damaged record (.mcap). It is not changed.
    """
    from kinfmu.cli.group import printable
    from kinfmu.log import recover as recovered
    from kinfmu.run.axis import axis_of
    from kinfmu.run.verdict import sentence

    target = output or run.with_name(f"{run.stem}-recovered.mcap")
    found = recovered(run, target)
    for event in found.events[-1:]:
        if event.level == "warning":
            click.echo(printable(f"at {axis_of(found).place(event.t)}: {event.text}"))
    click.echo(f"{sentence(found)}; written to {target}")


@main.command(epilog="Example: kinfmu review logs/crank_rocker.mcap --screenshot run.png --at 0.5")
@click.argument("run", type=InputFile(".mcap", ".rrd", or_folder=True))
@click.argument("other", required=False, type=InputFile(".mcap"))
@click.option("--save", type=OutputFile(".rrd"), help="Write the recording (.rrd) without opening the viewer.")
@click.option("--screenshot", type=OutputFile(".png"), help="Write a picture of the viewer (.png); needs no screen.")
@click.option(
    "--at",
    metavar="VALUE",
    help="Time of the picture [s], or driver value of a solve --angle, such as 45deg. Default: a third of the run.",
)
def review(run: Path, other: Path | None, save: Path | None, screenshot: Path | None, at: str | None) -> None:
    """Show a run in the Rerun viewer, or compare two.

    RUN and OTHER are records (.mcap) of simulate or solve. RUN may be a recording (.rrd), or the folder of study
    --recordings, whose designs are compared.
    """
    from kinfmu.log import review as reviewed
    from kinfmu.log.viewer.package import without_pandas

    if at is not None and screenshot is None:
        raise click.UsageError("--at needs --screenshot")

    def moment(timeline: Timeline) -> float:
        return on_axis("--at", at or "", timeline.label, timeline.unit)

    place = None if at is None else moment
    with without_pandas():
        recording = reviewed(run, other, save=save, screenshot=screenshot, at=place, report=note)
    made = [str(path) for path in (recording, screenshot) if path is not None]
    if made:
        click.echo(f"written: {listed(made)}")
