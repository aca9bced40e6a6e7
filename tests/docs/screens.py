"""Take screenshots of site, live pages, terminals and recordings: `python -m tests.docs.screens FOLDER [NAME ...]`.

Desktop and phone, light and dark, as whole pages; NAME: only these pages, by their path in docs/_build, without
`.html`. Prints what is wider than the window, and code that does not fit its column on a desktop. Terminals need the
program `script`, recordings a graphics driver (`scripts/graphics`).
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from html import escape
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.follow import files
from tests.docs.pictures import OPEN
from tests.page.engines import browser

SITE = Path(__file__).parents[2] / "docs" / "_build"
PAGES = (
    "index",
    "own-linkage",
    "tutorial",
    "gallery",
    "gallery/jansen_leg",
    "mechanism-files",
    "commands",
    "forces",
    "fmu",
    "accuracy",
    "glossary",
    "reference/api-run",
)
LIVE = tuple(
    f"gallery/live/{name}"
    for name in (
        "jansen_leg",
        "crank_rocker",
        "cam_roller",
        "excavator_loaded",
        "toggle_press",
        "geared_five_bar",
        "engine",
        "parallel_jaw",
    )
)
WIDTHS = {"desktop": 1440, "phone": 390}
TERMINALS = (
    "kinfmu --help",
    "kinfmu check jansen_leg",
    "kinfmu check engine",
    "kinfmu check open.toml",
    "kinfmu check double_pendulum --set crank.speeed=30rpm",
    "kinfmu study tolerances.toml --workers 1",
)
COLUMNS = {"wide": 110, "narrow": 60}  # of a terminal
THEMES = {"light": "#fff;color:#222", "dark": "#12171d;color:#ddd"}
INKS = {  # of codes
    "1": "font-weight:bold",
    "31": "color:#d33",
    "1;31": "font-weight:bold;color:#d33",
    "32": "color:#2a4",
    "36": "color:#29a",
    "90": "color:#888",
}
RECORDINGS = {  # commands that make each; the last one takes the picture
    "forces": ("simulate excavator_loaded", "review logs/excavator_loaded.mcap"),
    "limit": ("solve double_pendulum -o limit.mcap --times 0:4:0.01", "review limit.mcap"),
    "comparison": (
        "simulate jansen_leg --mcap leg.mcap",
        "simulate jansen_leg --set j=48.5 --mcap shorter.mcap",
        "review leg.mcap shorter.mcap",
    ),
    "designs": ("study tolerances.toml --workers 1 --recordings designs --restart", "review designs"),
}
HIGHEST = 5000  # [px] of a picture
WIDE = """() => {
    const page = document.scrollingElement;
    const found = page.scrollWidth > innerWidth ? [`page ${page.scrollWidth} px`] : [];
    const isDesktop = innerWidth > 1000;
    for (const code of document.querySelectorAll("article pre")) {
        const [longest] = code.textContent.trim().split("\\n").sort((a, b) => b.length - a.length);
        if (isDesktop && code.scrollWidth > code.clientWidth + 1) found.push(`code: ${longest}`);
    }
    return found;
}"""


def opened(chromium: Any, names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Yield each page at each width in each theme, with a name for its picture."""
    for size, width in WIDTHS.items():
        for theme in ("light", "dark"):
            options = {"color_scheme": theme, "reduced_motion": "reduce"}
            for name in names:
                with chromium.tab(**options) as page:
                    page.tab.set_viewport_size({"width": width, "height": 900})
                    page.tab.goto((SITE / f"{name}.html").as_uri())
                    page.tab.wait_for_load_state("networkidle")
                    page.tab.wait_for_timeout(300)
                    yield f"{name.replace('/', '-')}-{size}-{theme}", page.tab


def terminals(chromium: Any) -> Iterator[tuple[str, Any]]:
    """Yield what each command prints on a terminal, at two widths in each theme, with a name for its picture."""
    for command in TERMINALS:
        for size, columns in COLUMNS.items():
            line = ["script", "-qec", f"{Path(sys.executable).parent}/{command}", "/dev/null"]
            done = subprocess.run(line, env={**os.environ, "COLUMNS": str(columns)}, capture_output=True, text=True)
            printed = escape(re.sub(r"[^\n]*\r(?!\r?\n)|\x1b\[\?\w+", "", done.stdout))  # without bars of progress
            shown = re.sub(r"\x1b\[([\d;]+)m", lambda code: f'</b><b style="{INKS.get(code[1], "")}">', printed)
            for theme, colours in THEMES.items():
                with chromium.tab() as page:
                    page.tab.set_viewport_size({"width": 9 * columns, "height": 900})
                    page.tab.set_content(
                        f"<style>b{{font-weight:normal}}</style><body style='background:{colours}'><pre style='"
                        f"font-size:14px;width:{columns}ch;white-space:pre-wrap;word-break:break-all'>"
                        f"$ {command}\n\n<b>{shown}</b>"
                    )
                    yield f"terminal-{'-'.join(re.findall('[a-z_]+', command)[:3])}-{size}-{theme}", page.tab


def record(folder: Path) -> None:
    """Take the pictures of recordings."""
    for name, commands in RECORDINGS.items():
        picture = folder / f"recording-{name}.png"
        for command in commands:
            end = ("--screenshot", str(picture)) if command == commands[-1] else ()
            output = CliRunner().invoke(main, [*command.split(), *end]).output
        if not picture.exists():
            print(f"{picture.name}: {output}")


def take(folder: Path, name: str, tab: Any) -> None:
    """Take the picture of a page, and print what does not fit."""
    for wide in tab.evaluate(WIDE):
        print(f"{name}: {wide}")
    if "-live-" not in name:  # live pages fit their window
        high = min(tab.evaluate("document.documentElement.scrollHeight"), HIGHEST)
        tab.set_viewport_size({"width": tab.viewport_size["width"], "height": max(high, 900)})
        tab.wait_for_timeout(300)
    tab.screenshot(path=folder / f"{name}.png")


def take_all(folder: Path, names: tuple[str, ...]) -> None:
    """Write the pictures and print what does not fit."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, browser(Path(work)) as chromium:
        for name, tab in opened(chromium, names or PAGES + LIVE):
            take(folder, name, tab)
        if names:
            return
        with chdir(work):
            for name, text in {**files("studies.md"), "open.toml": OPEN}.items():
                Path(name).write_text(text, encoding="utf-8")
            for name, tab in terminals(chromium):
                take(folder, name, tab)
            record(folder)


if __name__ == "__main__":
    take_all(Path(sys.argv[1]).absolute(), tuple(sys.argv[2:]))
