"""kinfmu play: drag a mechanism in the browser."""

from __future__ import annotations

import threading

import click

from kinfmu.cli.arguments import mechanism_argument
from kinfmu.cli.group import main, note, patience


@main.command(epilog="Example: kinfmu play mine.toml")
@mechanism_argument
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port on this machine. Default: a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
def play(mechanism: str, port: int, no_browser: bool) -> None:
    """Drag a mechanism in the browser, with the solver of its native FMU.

    The page follows the file while you edit it; errors in the file are shown in the page. The page saves FMUs, tables,
    drawings and mechanism files with the lengths as set. Only this machine can open the address. Ctrl-C ends it.
    """
    import webbrowser

    from kinfmu.page.player import PlayServer, PlaySource

    with patience():
        source = PlaySource(mechanism)
    with PlayServer(source, port) as server:
        click.echo(server.url)
        if not no_browser and not webbrowser.open(server.url):
            note("no browser was found; open the address in one of this machine")
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            click.echo("", err=True)
