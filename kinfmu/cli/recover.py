"""kinfmu recover: write the samples of a killed run as a complete record."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu.cli.arguments import InputFile, OutputFile
from kinfmu.cli.group import main


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
    from kinfmu.cli.messages import printable
    from kinfmu.log import recover as recovered
    from kinfmu.run.axis import axis_of
    from kinfmu.run.verdict import sentence

    target = output or run.with_name(f"{run.stem}-recovered.mcap")
    found = recovered(run, target)
    for event in found.events[-1:]:
        if event.level == "warning":
            click.echo(printable(f"at {axis_of(found).place(event.t)}: {event.text}"))
    click.echo(f"{sentence(found)}; written to {target}")
