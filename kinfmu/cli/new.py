"""kinfmu new: write a mechanism file to start from."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from kinfmu.cli.arguments import OutputFile, exists, mechanism_argument
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError
from kinfmu.files import write_whole
from kinfmu.mechanism import gallery


@main.command(epilog="Example: kinfmu new crank_rocker mine.toml")
@mechanism_argument
@click.argument("file", type=OutputFile(".toml"))
def new(mechanism: str, file: Path) -> None:
    """Write a commented mechanism file to start from.

    FILE (.toml) is a copy of MECH.
    """
    if exists(file):
        raise click.UsageError(f"{file}: exists already; nothing was written")
    source = gallery.folder() / mechanism / "mechanism.toml" if mechanism in gallery.names() else Path(mechanism)
    try:
        if ":" in mechanism and gallery.has(mechanism):  # a chain has no file
            gallery.save(gallery.load(mechanism), file)
        else:
            write_whole(file, source.read_bytes())
    except OSError as error:
        raise KinfmuError(f"{file}: cannot be written ({error.strerror})") from None
    click.echo(f"{file}: written; next: kinfmu check {quote(str(file))}")
