"""Colours on dark paper: of strokes by their role, of everything else with enough contrast; style sheets of SVG."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import kinfmu
from kinfmu.draw import figure
from kinfmu.draw.overlay import curve_colour
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.dark import on_dark, with_dark_colours
from kinfmu.draw.sheet import GREY, INK
from tests.page.engines import Browser, needs_browser

RULE = re.compile(r"\[style\*=\"(fill|stroke): (#\w{6})\"\]\{(fill|stroke):(#\w{6})!important\}")


@pytest.mark.parametrize("role", ["edge", "fill", "paper", "ink"])
def test_a_stroke_has_the_same_role_on_dark_paper(role: str) -> None:
    for k in range(len(palette.BODIES)):
        colour = palette.body(k)
        assert on_dark(palette.tint(role, colour)) == palette.tint(role, colour, is_dark=True)


def test_curves_and_texts_are_seen_on_dark_paper() -> None:
    for k in range(12):
        assert palette.contrast(on_dark(curve_colour(k)), palette.DARK) > palette.LEAST_CONTRAST
    assert on_dark((68, 1, 84), is_area=True) == (68, 1, 84)  # an area of a scale of colours
    assert palette.contrast(on_dark((246, 222, 222), is_area=True), palette.DARK) < palette.LEAST_CONTRAST
    for colour in (INK, GREY):
        assert palette.contrast(on_dark(colour), palette.DARK) > 4.5


def test_a_figure_has_no_paper_and_a_rule_for_every_colour(tmp_path: Path) -> None:
    figure(kinfmu.load("crank_rocker"), tmp_path / "figure.svg")
    text = (tmp_path / "figure.svg").read_text("utf-8")
    ET.fromstring(text)  # noqa: S314  ours
    rules = {(key, light): dark for key, light, of, dark in RULE.findall(text) if key == of}
    drawn = set(re.findall(r"(fill|stroke): (#\w{6})", text.partition("</style>")[2]))
    assert rules.keys() == drawn
    assert "text{fill:#e8edf3}" in text
    assert ("stroke", palette.hexadecimal(palette.lighter(palette.body(0)))) in rules
    paper = text.partition("</style>")[2].partition('id="patch_1"')[2].partition("</g>")[0]
    assert "fill: none" in paper


def test_an_svg_keeps_its_colours_without_the_style_sheet() -> None:
    text = '<svg xmlns="http://www.w3.org/2000/svg"><path fill="#ffffff" stroke="#282828"/></svg>'
    styled = with_dark_colours(text)
    assert re.sub(r"<style>.*?</style>", "", styled, flags=re.DOTALL) == text
    assert '[stroke="#282828"]{stroke:#e8edf3!important}' in styled


@needs_browser
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.few(1)
def test_an_image_follows_the_page_that_shows_it(theme: str, chromium: Browser, tmp_path: Path) -> None:
    """The paper shows through, and the ink has contrast to it: the darkest or lightest pixel of the picture."""
    image = pytest.importorskip("PIL.Image")
    figure(kinfmu.load("crank_rocker"), tmp_path / "figure.svg")
    paper = palette.DARK if theme == "dark" else palette.WHITE
    colour = palette.hexadecimal(paper)
    page = f'<body style="margin:0;background:{colour}"><img style="color-scheme:{theme}" src="figure.svg">'
    (tmp_path / "page.html").write_text(page, "utf-8")
    with chromium.tab() as opened:
        opened.tab.goto((tmp_path / "page.html").as_uri())
        opened.tab.screenshot(path=tmp_path / "shot.png")
    with image.open(tmp_path / "shot.png") as shot:
        pixels = set(map(tuple, np.asarray(shot.convert("RGB")).reshape(-1, 3).tolist()))
    assert paper in pixels
    ink = palette.tint("ink", palette.INK, is_dark=theme == "dark")
    assert ink in pixels
    assert palette.tint("fill", palette.body(0), is_dark=theme == "dark") in pixels
