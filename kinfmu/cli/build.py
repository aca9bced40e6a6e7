"""kinfmu build: a mechanism as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import MECHANISM, SETTING
from kinfmu.cli.group import about, main
from kinfmu.cli.progress import Progress
from kinfmu.cli.settings import with_parameters

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option("-o", "output", type=click.Path(path_type=Path), help="Where to; <name>.fmu if nothing is said.")
@click.option(
    "--flavour",
    type=click.Choice(["python", "native"]),
    default="python",
    show_default=True,
    help="What the FMU is made of: Python, for hosts that are Python processes, or C, for all hosts.",
)
@click.option(
    "--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI; 3: native only."
)
@click.option(
    "--platforms",
    type=click.Choice(["host", "all"]),
    default="host",
    show_default=True,
    help="Of native FMUs: this platform, by the system's compiler, or all, by zig.",
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
    fmi: str,
    platforms: str,
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
    with about(mechanism), Progress("compiling for all platforms", least=2) as progress:
        path = built(
            mech,
            output or _own_folder(mech),
            flavour=flavour,
            drive=drive,
            outputs=wanted,
            fmi=int(fmi),
            platforms=platforms,
            progress=progress,
        )
    kinds = "co-simulation" if flavour == "python" else "co-simulation and model exchange"
    click.echo(f"{path}: {path.stat().st_size / 1000.0:.0f} kB, FMI {fmi}.0 {kinds}, driven by {drive}")


def _own_folder(mechanism: Mechanism) -> Path:
    """fmus/<name>/<name>.fmu where this is a checkout with that folder, else <name>.fmu here."""
    own = Path("fmus") / mechanism.name
    return (own if own.is_dir() else Path()) / f"{mechanism.name}.fmu"
