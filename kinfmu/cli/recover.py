"""kinfmu recover: what a killed run left, as a whole file."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu.cli.files import InputFile, OutputFile
from kinfmu.cli.group import main


@main.command(epilog="Example: kinfmu recover logs/fourbar.mcap")
@click.argument("run", type=InputFile())
@click.option(
    "-o",
    "output",
    type=OutputFile(".mcap"),
    help="The record to write; <RUN>-recovered.mcap beside RUN if nothing is said.",
)
def recover(run: Path, output: Path | None) -> None:
    """Make a whole record of what a killed run left.

    RUN is a record (.mcap) that was cut off or damaged, and stays as it is.
    """
    from kinfmu.cli.tell import printable
    from kinfmu.cli.verdict import verdict
    from kinfmu.log import recover as recovered
    from kinfmu.run.axis import axis_of

    target = output or run.with_name(f"{run.stem}-recovered.mcap")
    found = recovered(run, target)
    for event in found.events[-1:]:
        if event.level == "warning":
            click.echo(printable(f"at {axis_of(found).place(event.t)}: {event.text}"))
    click.echo(f"{verdict(found)}; written to {target}")
