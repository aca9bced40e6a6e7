"""kinfmu report: figure, verdicts, tables and plots as a page and as a PDF."""

from __future__ import annotations

import re
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path

import pytest

import kinfmu
from tests.cli.conftest import Command

SHEETS = ["jansen_leg", "excavator_loaded", "cam_roller"]


def images(page: str) -> list[str]:
    """The pictures of a page as SVG."""
    return [b64decode(one).decode() for one in re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', page)]


@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.few(2)
def test_a_page_holds_figure_verdicts_tables_and_plots(name: str, command: Command) -> None:
    result = command("report", name, "-o", "sheets/report.html")
    assert (result.exit_code, result.stdout) == (0, f"{Path('sheets', 'report.html')}: written\n")
    page = Path("sheets/report.html").read_text("utf-8")
    mechanism = kinfmu.load(name)
    assert f"<h1>{name}: {mechanism.title.replace(chr(39), '&#x27;')}</h1>" in page
    assert kinfmu.check(mechanism).summary().html() in page
    assert "prefers-color-scheme: dark" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)  # all that it shows is in it
    drawing, *plots = images(page)
    assert all(f">{body.name}<" in drawing for body in mechanism.moving_bodies)
    assert any("[deg]" in plot for plot in plots)
    assert any("/s" in plot for plot in plots)
    assert any("/s²" in plot for plot in plots)
    assert not any(re.search(r"crank_angle|\.phi|\.omega", plot) for plot in plots)
    assert any(re.search(r"\bN\]", plot) for plot in plots) == mechanism.has_masses
    assert ("not drawn: bucket.φ" in page) is (name == "excavator_loaded")  # four curves a plot
    assert not any("crank.phi" in plot for plot in plots)  # a straight line over the crank's angle


@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.few(1)
def test_equal_reports_are_equal_pdfs(name: str, command: Command) -> None:
    for path in ("one.pdf", "two.pdf"):
        assert command("report", name, "-o", path).exit_code == 0
    first, second = Path("one.pdf").read_bytes(), Path("two.pdf").read_bytes()
    assert first == second
    assert first.startswith(b"%PDF")
    assert len(re.findall(rb"/Type /Page\b", first)) == (2 if name == "excavator_loaded" else 1)


def test_a_problem_is_in_the_report_and_ends_the_command(
    fails: Callable[..., str], fourbar_file: Callable[..., Path]
) -> None:
    path = fourbar_file("length = 1\n", "length = 1.01\n")
    message = fails("report", path, "-o", "report.html")
    assert message.startswith(f"{path}: [joints.AB] contradicts the other joints")
    assert Path("report.html").read_text("utf-8").count("[joints.AB] contradicts the other joints") == 1
    fails("report", path, "-o", "report.pdf")
    assert Path("report.pdf").read_bytes().startswith(b"%PDF")


def test_numbers_that_are_set_are_those_of_the_report(command: Command) -> None:
    command("report", "jansen_leg", "--set", "m=14", "-o", "report.html")
    assert ", 14, " in Path("report.html").read_text("utf-8")
