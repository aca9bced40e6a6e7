"""kinfmu review: show runs in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import InputFile, OutputFile
from kinfmu.cli.group import main
from kinfmu.cli.messages import note
from kinfmu.cli.quantities import on_axis
from kinfmu.errors import listed

if TYPE_CHECKING:
    from kinfmu.log.viewer.timeline import Timeline


@main.command(epilog="Example: kinfmu review logs/crank_rocker.mcap --screenshot run.png --at 0.5")
@click.argument("run", type=InputFile(".mcap", ".rrd"))
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

    RUN and OTHER are records (.mcap) of simulate or solve; RUN may be a recording (.rrd).
    """
    from kinfmu.log import review as reviewed

    if at is not None and screenshot is None:
        raise click.UsageError("--at needs --screenshot")

    def moment(timeline: Timeline) -> float:
        return on_axis("--at", at or "", timeline.label, timeline.unit)

    place = None if at is None else moment
    recording = reviewed(run, other, save=save, screenshot=screenshot, at=place, report=note)
    made = [str(path) for path in (recording, screenshot) if path is not None]
    click.echo(f"written: {listed(made)}")
