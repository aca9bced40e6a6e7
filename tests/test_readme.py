"""The README's code runs and its comments are true."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism.toml_file import parse

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_ten_lines_of_python_run_and_their_comments_are_true(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(_block("python"), "README.md", "exec"), {})  # noqa: S102  our own page
    mobility, position, off = capsys.readouterr().out.splitlines()
    assert mobility == "1 1"
    x, vx = map(float, position.split())
    assert x == pytest.approx(40, abs=1e-12)
    assert vx == pytest.approx(-80 / 3, abs=1e-12)
    assert 0.19 < float(off) < 0.2
    assert len([line for line in _block("python").splitlines() if line and not line.startswith("#")]) <= 10


def test_the_ten_lines_of_toml_turn_all_the_way() -> None:
    assert len(_block("toml").splitlines()) == 10
    report = kinfmu.check(parse(_block("toml"), "README.md"))
    assert report.problem is None
    assert report.mobility == 1
    assert report.range is not None
    assert report.range.low is None
    run = kinfmu.solve(report.mechanism, np.arange(0.0, 6.3, 0.1))
    assert run.good.all()
    assert "crank-rocker" in str(report)


def test_the_scripts_of_the_readme_exist() -> None:
    for script in re.findall(r"scripts/(\w+)", README):
        assert (ROOT / "scripts" / script).is_file()


def test_the_comparison_is_that_of_the_accuracy_page(request: pytest.FixtureRequest) -> None:
    begin, end = "<!-- comparison -->", "<!-- end: comparison -->"
    before, rest = README.split(begin)
    table, after = rest.split(end)
    if request.config.getoption("--update"):
        text = f"{before}{begin}\n\n{_comparison()}\n\n{end}{after}"
        (ROOT / "README.md").write_text(text, encoding="utf-8", newline="\n")
    else:
        assert table.strip() == _comparison(), "docs/accuracy.md has changed; pytest tests/test_readme.py --update"


def _comparison() -> str:
    """Return the README's table: two mechanisms and a change point, from the generated tables of docs/accuracy.md."""
    page = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")
    mechanisms = ("crank_rocker", "jansen_leg")
    head, *engines = _rows(page.split("<!-- generated: engines -->")[1])
    chosen = [next(k for k, cell in enumerate(head) if f"`{name}`" in cell) for name in mechanisms]
    at_head, *singular = _rows(page.split("<!-- generated: singular points -->")[1])
    at_point = {row[0]: row[at_head.index("at it")] for row in singular}
    links = [f"[`{name}`](fmus/{name}/README.md)" for name in mechanisms]
    lines = [f"| | {' | '.join(links)} | errors of q, qd, qdd at a change point |", "|---|---|---|---|"]
    for row in engines:
        if row[0] != "generated Python":  # a part of kinfmu, explained on the page
            cells = [row[0], *(row[k] for k in chosen), at_point.get(row[0], "")]
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _rows(text: str) -> list[list[str]]:
    """Return the cells of the first Markdown table of a text, line by line, without the ruler."""
    table = text.strip().split("\n\n")[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table if not line.startswith("|---")]


def test_the_version_is_typed_once() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "kinfmu.version.VERSION"}
    assert kinfmu.__version__ == kinfmu.VERSION
