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


def test_the_readme_is_read_in_two_minutes() -> None:
    assert len(README.split()) <= 600


def test_the_version_is_typed_once() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "kinfmu.version.VERSION"}
    assert kinfmu.__version__ == kinfmu.VERSION
