"""kinfmu review: runs in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import on_axis
from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import main
from kinfmu.cli.tell import note
from kinfmu.errors import listed

if TYPE_CHECKING:
    from kinfmu.log.viewer.timeline import Timeline


@main.command(epilog="Example: kinfmu review logs/fourbar.mcap --screenshot fourbar.png --at 45")
@click.argument("run", type=InputFile(".mcap", ".rrd"))
@click.argument("other", required=False, type=InputFile(".mcap"))
@click.option("--save", type=OutputFile(".rrd"), help="Write the recording (.rrd) and open no viewer.")
@click.option("--screenshot", type=OutputFile(".png"), help="Take a picture (.png) with a viewer that needs no screen.")
@click.option(
    "--at",
    metavar="VALUE",
    help="Time of the picture [s], or of a solve --angle the driver's value, such as 45deg; default: a third of the "
    "run.",
)
def review(run: Path, other: Path | None, save: Path | None, screenshot: Path | None, at: str | None) -> None:
    """Look at a run in the Rerun viewer, or at two compared.

    RUN and OTHER are records (.mcap) of simulate or solve; RUN may be a recording (.rrd).
    """
    from kinfmu.log import review as reviewed

    if at is not None and screenshot is None:
        raise click.UsageError("--at is the time of --screenshot, which is not given")

    def moment(timeline: Timeline) -> float:
        return on_axis(at or "", "--at", timeline.label, timeline.unit)

    place = None if at is None else moment
    recording = reviewed(run, other, save=save, screenshot=screenshot, at=place, report=note)
    made = [str(path) for path in (recording, screenshot) if path is not None]
    click.echo(f"made {listed(made)}")
