"""kinfmu report: figure, verdicts, tables and plots of a mechanism on one sheet."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinfmu.cli.arguments import OutputFile, mechanism_argument
from kinfmu.cli.group import errors_of, main
from kinfmu.cli.settings import checked_settings, set_option
from kinfmu.display import escaped
from kinfmu.errors import KinfmuError
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery

if TYPE_CHECKING:
    from kinfmu.analysis import Report
    from kinfmu.run import Run

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; }
body { color: #1f2328; background: #ffffff; }
table { border-collapse: collapse; }
th, td { padding: 0.15em 1em 0.15em 0; }
h1 { font-size: 1.5em; }
@media (max-width: 30em) { body { font-size: 13px; } th, td { padding-right: 0.7em; } }
div { overflow-x: auto; }
div:last-child p { display: inline-block; margin: 0; }
small { display: block; }
@media screen and (prefers-color-scheme: dark) {
  body { color: #d1d7e0; background: #151b23; }
  .ok { color: #3fb950 !important; }
  .note, .advice { color: #4493f8 !important; }
  .poor, .problem { color: #f85149 !important; }
}
@media print { body { margin: 0; max-width: none; } }
"""


@main.command(epilog="Example: kinfmu report crank_rocker -o crank_rocker.pdf")
@mechanism_argument
@click.option("-o", "--output", type=OutputFile(".html", ".pdf"), required=True, help="The sheet: .html or .pdf.")
@set_option
def report(mechanism: str, output: Path, settings: tuple[tuple[str, str], ...]) -> None:
    """Write figure, verdicts, tables and plots on one sheet.

    To print or to file. They are those of check; the plots show the motion that its measures and forces are taken of.
    An .html file holds all that it shows, and is light or dark like its reader. Needs matplotlib.
    """
    from kinfmu.analysis import check
    from kinfmu.draw.document import document
    from kinfmu.draw.writing import write_bytes

    loaded = gallery.load(mechanism)
    mech = checked_settings(loaded, settings).mechanism()
    with errors_of(mechanism):
        found = check(mech, written=loaded)
        run = _motion(found)
        if suffix_of(output) == ".pdf":
            document(output, found.summary(), mech, run)
        else:
            write_bytes(output, _page(found, run).encode())
        click.echo(f"{output}: written")
        if found.problem is not None:
            raise found.problem


def _motion(found: Report) -> Run | None:
    """Return the motion that measures and forces are taken of; None without one."""
    from kinfmu.analysis.measuring import motion_of_check
    from kinfmu.run.solve import solve

    if found.plan is None:
        return None
    try:
        run = solve(found.mechanism, **motion_of_check(found.mechanism, found.ranges)[0])
    except KinfmuError:
        return None  # the report states why
    return run if run.good.any() else None


def _page(found: Report, run: Run | None) -> str:
    """Return the sheet as a page that holds all that it shows."""
    from kinfmu.draw.document import drawing_svg, plots_note, plots_svg
    from kinfmu.notebook import picture, title

    name = title(found.mechanism)
    parts = [picture(lambda: drawing_svg(found.mechanism), f"Drawing of {name}")]
    if found.problem is not None and escaped(found.problem) in parts[0]:
        parts.clear()  # the verdicts state it
    parts.append(found.summary().html())
    with suppress(KinfmuError):  # the drawing states that matplotlib is missing
        if run is not None:
            note = f"<small>{escaped(plots_note(run))}</small>"
            parts.append("".join(picture(partial(str, svg), f"Plot of {name}") for svg in plots_svg(run)) + note)
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{escaped(name)}</title>'
    body = "\n".join(f"<div>{part}</div>" for part in parts)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>{head}\n<style>{_STYLE}</style></head>\n'
        f"<body>\n<main>\n<h1>{escaped(name)}</h1>\n{body}\n</main>\n</body>\n</html>\n"
    )
