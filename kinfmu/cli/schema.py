"""kinfmu schema: write the JSON Schema of mechanism files."""

from __future__ import annotations

from pathlib import Path

import click

from kinfmu.cli.arguments import OutputFile
from kinfmu.cli.group import main
from kinfmu.errors import KinfmuError
from kinfmu.files import write_whole


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
    try:
        write_whole(output, schema_text().encode())
    except OSError as error:
        raise KinfmuError(f"{output}: cannot be written ({error.strerror})") from None
    click.echo(f"{output}: written; a mechanism file names it in its first line: #:schema {output}")
