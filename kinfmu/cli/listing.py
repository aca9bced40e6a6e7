"""kinfmu list: the gallery."""

from __future__ import annotations

import click

from kinfmu.cli.group import main
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
