"""kinfmu import: write the drawing of another program as a mechanism file."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import click

from kinfmu.cli.arguments import ArgumentType, OutputFile, existing
from kinfmu.cli.group import main, note
from kinfmu.errors import KinfmuError
from kinfmu.files import errors_of_writing, write_whole
from kinfmu.mechanism.imports import imported, is_pmks_link
from kinfmu.mechanism.toml_document import content_of


class DrawingArgument(ArgumentType):
    """An existing file, or a link."""

    name = "SOURCE"

    def read(self, text: str) -> Path | str:
        return text if is_pmks_link(text) else existing(text)


@main.command("import", epilog="Example: kinfmu import press.linkage2 -o press.toml")
@click.argument("source", type=DrawingArgument())
@click.option("-o", "output", type=OutputFile(".toml"), help="The mechanism file to write. Default: print it.")
def import_(source: Path | str, output: Path | None) -> None:
    """Write a drawing of another program as a mechanism file.

    SOURCE is a link of PMKS+ in quotes, a .linkage2 file of Linkage, or a DXF drawing with a layer for each body. The
    content of a file shows its format. What is left out or chosen is printed, and listed at the head of the mechanism
    file.
    """
    if isinstance(source, Path):
        drawing = imported(content_of(source, "a drawing to import"), str(source))
    else:
        drawing = imported(source)
    for text in drawing.notes:
        note(text)
    if output is None:
        click.echo(drawing.text, nl=False)
        return
    with errors_of_writing(output, KinfmuError):
        write_whole(output, drawing.text.encode())
    click.echo(f"{output}: written; next: kinfmu check {quote(str(output))}")
