"""Draw the pictures of docs/ whose files are in its pages: `python -m tests.docs.pictures` (scripts/pictures calls it).

Studies and the fit come from the files in their pages, the page of a mechanism from headless Chromium.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.draw import animate, figure
from kinfmu.page import page
from tests.mechanism.loads.every_load import every_load
from tests.page.editor.hand import drawing_hand
from tests.page.engines import DESKTOP, PHONE, browser

DOCS = Path(__file__).parents[2] / "docs"
COMMANDS = {  # of each page with files, and the pictures that they draw
    "studies.md": {
        "study tolerances.toml --figure {} --workers 1": "study-tolerances.svg",
        "study lengths.toml --measures swing --figure {} --workers 1": "study-contours.svg",
        "study response.toml --figure {} --workers 1": "study-response.svg",
        "study samples.toml --measures swing,fastest --figure {} --workers 1": "study-ranges.png",
    },
    "fitting.md": {"fit arch.toml -o fitted.toml --starts 8 --seed 1 --workers 1 --figure {}": "fitted.svg"},
}
RANGES = """\
mechanism = "hoeken.toml"
designs = 256

[parameters]
crank = { from = "15 mm", to = "25 mm" }
base = { from = "35 mm", to = "60 mm" }
"""
ONE_GRID = """\
mechanism = "hoeken.toml"

[parameters]
crank = { from = "10 mm", to = "28 mm", count = 37 }
"""
OPEN = """\
name = "open"
title = "Four-bar whose coupler is too short"
units.length = "mm"
bodies.ground.points = { O = [0, 0], C = [90, 0] }
bodies.crank = { points = { O = [0, 0], P = [30, 0] }, start = { phi = "60 deg" } }
bodies.coupler = { points = { P = [0, 0], Q = [30, 0] }, start = { x = 15, y = 26, phi = "-10 deg" } }
bodies.rocker = { points = { C = [0, 0], Q = [25, 0] }, start = { x = 90, phi = "130 deg" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "coupler.P"] }
joints.Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
joints.C = { type = "revolute", between = ["ground.C", "rocker.C"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", start = "60 deg", speed = "30 rpm" }
"""
PAGES: dict[str, tuple[Any, Any, str]] = {  # size, theme, mechanism
    "play.png": (DESKTOP, "light", "jansen_leg"),
    "play-phone.png": (PHONE, "dark", "cam_roller"),
}


def draw_files() -> None:
    """Draw the pictures of studies and fits."""
    before = Path.cwd()
    for name, commands in COMMANDS.items():
        text = (DOCS / name).read_text("utf-8")
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            Path("samples.toml").write_text(RANGES, "utf-8")
            Path("response.toml").write_text(ONE_GRID, "utf-8")
            for first, content in re.findall(r"`(\w+\.toml)`[^`]*:\n\n```toml\n(.*?)```", text, re.DOTALL):
                Path(first).write_text(content, "utf-8")
            if name == "fitting.md":
                blocks = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
                Path("guide.toml").write_text(blocks[0], "utf-8")
                Path("arch.toml").write_text(blocks[1], "utf-8")
            for command, picture in commands.items():
                result = CliRunner().invoke(main, command.format(DOCS / picture).split())
                if result.exit_code:
                    raise SystemExit(result.output)
            os.chdir(before)


def draw_gap() -> None:
    """Draw a mechanism that does not close."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "open.toml")
        path.write_text(OPEN, "utf-8")
        result = CliRunner().invoke(main, ["check", str(path), "--figure", str(DOCS / "gap.svg")])
        if result.exit_code != 1 or "gap" not in result.output:
            raise SystemExit(result.output)


def draw_dark() -> None:
    """Draw the leg of the README for dark pages."""
    animate(kinfmu.solve(kinfmu.load("jansen_leg")), DOCS / "jansen_leg-dark.gif", dark=True)


def draw_loads() -> None:
    """Draw a mechanism with a load of every kind."""
    figure(every_load(), DOCS / "loads.svg")


def draw_pages() -> None:
    """Draw pages of mechanisms as they open, on a screen and on a phone."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        program = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for picture, (size, theme, name) in PAGES.items():
            path = Path(folder, f"{name}.html")
            path.write_text(page(kinfmu.load(name)), "utf-8")
            tab = program.new_page(viewport=size, color_scheme=theme, reduced_motion="reduce")
            tab.goto(path.as_uri())
            tab.wait_for_function("window.kinfmu && !window.kinfmu.isAsked")
            tab.evaluate("() => window.kinfmu.refresh(() => window.kinfmu.move(0, 2.2))")
            tab.wait_for_timeout(1000)  # until names are at free places
            tab.screenshot(path=DOCS / picture)
        program.close()


def draw_editor() -> None:
    """Draw the editor while the last link of a four-bar is drawn."""
    with tempfile.TemporaryDirectory() as name, browser(Path(name)) as chromium:
        os.environ["KINFMU_STATES"] = str(Path(name, "states"))
        with drawing_hand(chromium, Path(name), color_scheme="light") as hand:
            hand.page.resize(DESKTOP)
            hand.tool("ground")
            hand.click((0, 0), (140, 0))
            hand.tool("link")
            hand.click((0, 0), (0, 40), (100, 90))
            hand.page.tab.mouse.move(*hand.at((135, 5)))
            hand.wait()
            hand.page.tab.screenshot(path=DOCS / "draw.png")


if __name__ == "__main__":
    draw_files()
    draw_gap()
    draw_dark()
    draw_loads()
    draw_pages()
    draw_editor()
