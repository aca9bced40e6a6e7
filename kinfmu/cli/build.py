"""kinfmu build: a mechanism as an FMU."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MECHANISM, OUTPUTS_HELP, names_in, set_option
from kinfmu.cli.group import about, main
from kinfmu.cli.progress import Progress
from kinfmu.cli.settings import settled


@main.command(epilog="Example: kinfmu build fourbar --flavour native --fmi 3 -o fourbar.fmu")
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option(
    "-o",
    "output",
    type=click.Path(path_type=Path),
    help="The .fmu to write, or a folder for it. If nothing is said: <name>.fmu in the current folder; for a mechanism "
    "of the gallery in fmus/<name>/ where the current folder has that.",
)
@click.option(
    "--flavour",
    type=click.Choice(["python", "native"]),
    default="python",
    show_default=True,
    help="python: for hosts that are Python processes, such as fmpy; native: C, for every host.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI; 3 needs --flavour native.",
)
@click.option(
    "--platforms",
    type=click.Choice(["host", "all"]),
    default="host",
    show_default=True,
    help="host: this machine's, by its own compiler; all: Linux, Windows and macOS, by zig; needs --flavour native.",
)
@click.option(
    "--drive",
    type=click.Choice(["time", "inputs"]),
    help="What moves the drivers at first: time, by the laws of the file, or inputs such as crank_angle; "
    "time if nothing is said, unless a law is external. The FMU's parameter driven_by_time changes it.",
)
@click.option("--outputs", metavar="NAMES", help=f"{OUTPUTS_HELP}; what they do not need is not solved.")
@set_option
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
    """Build the FMU of a mechanism.

    It is for co-simulation; a native one for model exchange, too.
    """
    from kinfmu.fmu import build as built
    from kinfmu.fmu.build import default_drive

    for option, value, plain in (("--fmi", fmi, "2"), ("--platforms", platforms, "host")):
        if flavour == "python" and value != plain:
            raise click.UsageError(f"{option} {value} needs --flavour native; the python flavour has {option} {plain}")
    mech = settled(mechanism, gallery.load(mechanism), settings).mechanism()
    drive = drive or default_drive(mech)
    with about(mechanism), Progress("compiling for all platforms", least=2) as progress:
        path = built(
            mech,
            output or _place(mechanism, mech.name),
            flavour=flavour,
            drive=drive,
            outputs=names_in(outputs),
            fmi=int(fmi),
            platforms=platforms,
            progress=progress,
        )
    kinds = "co-simulation" if flavour == "python" else "co-simulation and model exchange"
    click.echo(f"{path}: {path.stat().st_size / 1000.0:.0f} kB, FMI {fmi}.0 {kinds}, driven by {drive}")


def _place(given: str, name: str) -> Path:
    """<name>.fmu here; in fmus/<name>/ of a checkout for a mechanism of the gallery, given by its name."""
    own = Path("fmus") / name
    return (own if given in gallery.names() and own.is_dir() else Path()) / f"{name}.fmu"
