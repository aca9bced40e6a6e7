"""kinfmu play: drag a mechanism in the browser."""

from __future__ import annotations

import threading
from pathlib import Path

import click

from kinfmu.cli.arguments import MechanismName, OutputFile
from kinfmu.cli.group import main, note, patience


@main.command(epilog="Example: kinfmu play mine.toml; kinfmu play --new mine.toml")
@click.argument("mechanism", type=MechanismName(), metavar="MECH", required=False)
@click.option("--new", type=OutputFile(".toml"), metavar="FILE", help="Draw a mechanism; FILE must not be there yet.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port on this machine. Default: a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address only.")
def play(mechanism: str | None, new: Path | None, port: int, no_browser: bool) -> None:
    """Drag a mechanism in the browser.

    The page computes with the solver of the native FMU and follows the file while you edit it; errors in the file are
    shown in the page. It saves FMUs, tables, drawings and mechanism files with the lengths as set. Only this machine
    can open the address. Ctrl-C ends it.

    The button Draw in the page of a file draws it further: bars, joints, motors, cylinders, gears, cams, loads. Every
    step can be undone, also after the program has ended; the file is written when you save it.
    """
    import webbrowser

    if (mechanism is None) == (new is None):
        raise click.UsageError("name a mechanism to play, or with --new the file of one to draw")
    from kinfmu.page.player import PlayServer, PlaySource

    with patience():
        source = PlaySource(mechanism or str(new), is_new=new is not None)
    with PlayServer(source, port) as server:
        click.echo(server.url)
        if not no_browser and not webbrowser.open(server.url):
            note("no browser was found; open the address in one of this machine")
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            click.echo("", err=True)
