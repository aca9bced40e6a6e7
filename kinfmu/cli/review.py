"""kinfmu review: runs in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu.cli.arguments import TIME
from kinfmu.cli.group import main
from kinfmu.errors import listed


@main.command()
@click.argument("run", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("other", required=False, type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--save",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the recording (.rrd) instead of opening the viewer.",
)
@click.option(
    "--screenshot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Take a picture (.png) with a viewer that needs no screen.",
)
@click.option("--at", type=TIME, help="Time of the picture [s].")
def review(run: Path, other: Path | None, save: Path | None, screenshot: Path | None, at: float | None) -> None:
    """Open the Rerun viewer on RUN (.mcap), or on two runs compared."""
    from kinfmu.log import review as reviewed

    recording = reviewed(run, other, save=save, screenshot=screenshot, at=at)
    made = [str(path) for path in (recording, screenshot) if path is not None]
    click.echo(f"made {listed(made)}")
