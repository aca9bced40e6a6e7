"""kinfmu list: the gallery; kinfmu new: write a mechanism file to start from; kinfmu schema: write its JSON Schema."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from kinfmu.cli.arguments import OutputFile, exists, mechanism_argument
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError
from kinfmu.files import errors_of_writing, write_whole
from kinfmu.mechanism import gallery


@main.command("list", epilog="Example: kinfmu list")
def list_() -> None:
    """List the mechanisms of the gallery.

    Use their names as MECH in other commands.
    """
    names = gallery.names()
    width = max(map(len, names), default=0)
    for name in names:
        click.echo(f"{name:{width}}  {gallery.load(name).title}")


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
    with errors_of_writing(file, KinfmuError):
        if ":" in mechanism and gallery.has(mechanism):  # a chain has no file
            gallery.save(gallery.load(mechanism), file)
        else:
            write_whole(file, source.read_bytes())
    name = quote(str(file))
    click.echo(f"{file}: written; next: kinfmu check {name}; to see it move: kinfmu play {name}")


@main.command(epilog="Example: kinfmu schema -o mechanism.schema.json")
@click.option("-o", "output", type=OutputFile(), help="The file to write. Default: print it.")
def schema(output: Path | None) -> None:
    """Write the JSON Schema of mechanism files.

    Editors use it to complete and check mechanism files.
    """
    from kinfmu.mechanism.schema import schema_text

    if output is None:
        click.echo(schema_text(), nl=False)
        return
    with errors_of_writing(output, KinfmuError):
        write_whole(output, schema_text().encode())
    click.echo(f"{output}: written; a mechanism file names it in its first line: #:schema {output}")
