"""kinfmu new: a mechanism file to start from."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu import gallery
from kinfmu.cli.arguments import MECHANISM, exists
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError


@main.command()
@click.argument("mechanism", metavar="MECH")
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
def new(mechanism: str, file: Path) -> None:
    """Write a commented starting FILE, from gallery mechanism MECH."""
    if file.suffix != ".toml":
        raise click.UsageError(f"{file}: a mechanism file ends in .toml")
    if exists(file):
        raise KinfmuError(f"{file}: is there already; nothing was written")
    name = MECHANISM.convert(mechanism, None, None)
    source = gallery.folder() / name / "mechanism.toml" if name in gallery.names() else Path(name)
    try:
        if ":" in name and gallery.has(name):  # a chain, which no file holds
            gallery.save(gallery.load(name), file)
        else:
            file.write_bytes(source.read_bytes())
    except OSError as error:
        raise KinfmuError(f"{file}: cannot be written ({error.strerror})") from None
    click.echo(f"{file}: written; next: kinfmu check {file}")
