"""kinfmu build: a mechanism as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import MECHANISM, SETTING
from kinfmu.cli.group import about, main
from kinfmu.cli.settings import with_parameters

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option("-o", "output", type=click.Path(path_type=Path), help="Where to; <name>.fmu if nothing is said.")
@click.option(
    "--flavour", type=click.Choice(["python"]), default="python", show_default=True, help="What the FMU is made of."
)
@click.option(
    "--drive",
    type=click.Choice(["time", "inputs"]),
    help="What drives at first: the file's laws or the inputs; time, unless a law is external.",
)
@click.option("--outputs", help="Coordinates that the FMU shall have, with commas; all if nothing is said.")
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank=40mm.")
def build(
    mechanism: str,
    output: Path | None,
    flavour: str,
    drive: Any,
    outputs: str | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Build the FMU of a mechanism."""
    from kinfmu.fmu import build as built
    from kinfmu.fmu.build import default_drive

    mech = with_parameters(mechanism, settings)
    drive = drive or default_drive(mech)
    wanted = [name.strip() for name in outputs.split(",")] if outputs else None
    with about(mechanism):
        path = built(mech, output or _own_folder(mech), flavour=flavour, drive=drive, outputs=wanted)
    click.echo(f"{path}: {path.stat().st_size / 1000.0:.0f} kB, FMI 2.0 co-simulation, driven by {drive}")


def _own_folder(mechanism: Mechanism) -> Path:
    """fmus/<name>/<name>.fmu where this is a checkout with that folder, else <name>.fmu here."""
    own = Path("fmus") / mechanism.name
    return (own if own.is_dir() else Path()) / f"{mechanism.name}.fmu"
