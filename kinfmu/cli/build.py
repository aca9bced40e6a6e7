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
from kinfmu.errors import listed


@main.command(epilog="Example: kinfmu build fourbar --fmi 3 -o fourbar.fmu")
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
    help="native: C, for every host; python: for hosts that are Python processes, such as fmpy. "
    "Default: native where a C compiler is found, else python.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI; the python flavour has 2 only.",
)
@click.option(
    "--platforms",
    type=click.Choice(["host", "all"]),
    default="host",
    show_default=True,
    help="host: this machine's, by its own compiler; all: Linux, Windows and macOS, by zig; native flavour only.",
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
    flavour: str | None,
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
    from kinfmu.fmu.build import default_drive, default_flavour, native_obstacle, platforms_of

    for option, value, plain in (("--fmi", fmi, "2"), ("--platforms", platforms, "host")):
        if flavour == "python" and value != plain:
            raise click.UsageError(f"{option} {value} needs --flavour native; the python flavour has {option} {plain}")
    mech = settled(mechanism, gallery.load(mechanism), settings).mechanism()
    drive = drive or default_drive(mech)
    chosen = flavour or default_flavour(int(fmi), platforms)
    with about(mechanism), Progress("compiling for all platforms", least=2) as progress:
        path = built(
            mech,
            output or _place(mechanism, mech.name),
            flavour=chosen,
            drive=drive,
            outputs=names_in(outputs),
            fmi=int(fmi),
            platforms=platforms,
            progress=progress,
        )
    is_native = chosen == "native"
    kinds = "co-simulation and model exchange" if is_native else "co-simulation"
    where = listed(platforms_of(path)) + ("" if is_native else " in hosts that hold Python")
    size = f"{path.stat().st_size / 1000.0:.0f} kB"
    click.echo(f"{path}: {size}, {chosen} FMU for {where}, FMI {fmi}.0 {kinds}, driven by {drive}")
    obstacle = native_obstacle() if flavour is None and not is_native else ""
    if obstacle:
        click.echo(f"a native FMU, which every host can load, is not possible here: {obstacle}", err=True)


def _place(given: str, name: str) -> Path:
    """<name>.fmu here; in fmus/<name>/ of a checkout for a mechanism of the gallery, given by its name."""
    own = Path("fmus") / name
    return (own if given in gallery.names() and own.is_dir() else Path()) / f"{name}.fmu"
