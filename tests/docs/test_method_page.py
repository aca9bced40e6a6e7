"""docs/method.md: its Python runs and prints what the page shows, which is also what `check` and `solve` find."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.executed import executed

DOCS = Path(__file__).parents[2] / "docs"
PATH = DOCS / "method.md"


def test_the_python_of_the_page_prints_what_it_shows(request: pytest.FixtureRequest) -> None:
    page = executed(PATH)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PATH.read_text(encoding="utf-8"), "docs/method.md is old; pytest tests/docs --update"
    assert "False" not in page


def test_the_jacobian_of_the_page_is_that_of_check() -> None:
    page = PATH.read_text(encoding="utf-8")
    shown = page.split("show(jacobian(q60))\n```\n\n```text\n")[1].split("```")[0]
    rows = [[float(cell) for cell in re.findall(r"-?\d+\.\d*", line)] for line in shown.splitlines()]
    printed = CliRunner().invoke(main, ["check", "fourbar", "--matrices"]).output.split("Phi_K,q at")[1]
    (*joints, _) = rows
    for label, row in zip(("P.x", "P.y", "Q.x", "Q.y", "AB.length"), joints, strict=True):
        (line,) = re.findall(rf"^{label} (.*)$", printed.split("row-reduced")[0], re.MULTILINE)
        assert [float(cell) for cell in line.split()] == row, label


def test_every_file_and_constant_of_the_algorithm_exists() -> None:
    page = (DOCS / "algorithm.md").read_text(encoding="utf-8")
    files = re.findall(r"`(kinfmu/[\w/]+(?:\.py)?)/?`", page)
    assert len(files) > 10
    for name in files:
        assert (DOCS.parent / name).exists(), name
    cited = set(re.findall(r"\[(\d+)\](?!\()", page.split("## References")[0]))
    assert cited == set(re.findall(r"^(\d+)\. ", page.split("## References")[1], re.MULTILINE))
