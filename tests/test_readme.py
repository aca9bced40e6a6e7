"""The README's code runs and its comments are true."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import gallery
from kinfmu.mechanism.toml_file import parse

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _block(language: str) -> str:
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_ten_lines_of_python_run_and_say_what_they_promise(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(_block("python"), "README.md", "exec"), {})  # noqa: S102  our own page
    mobility, position, apart = capsys.readouterr().out.splitlines()
    assert mobility == "1 ['AB']"
    x, vx = map(float, position.split())
    assert x == pytest.approx(1.5, abs=1e-12)
    assert vx == pytest.approx(-np.sin(np.pi / 3), abs=1e-12)
    assert float(apart) < 1e-12
    assert len([line for line in _block("python").splitlines() if line and not line.startswith("#")]) <= 10


def test_the_linkage_of_ones_own_turns_all_the_way() -> None:
    report = kinfmu.check(parse(_block("toml"), "README.md"))
    assert report.problem is None
    assert report.mobility == 1
    assert report.range is not None
    assert report.range.low is None
    run = kinfmu.solve(report.mechanism, np.arange(0.0, 6.3, 0.1))
    assert run.good.all()
    assert "tip.x" in run.outputs


def test_every_room_of_the_house_is_on_the_map_and_every_room_on_the_map_exists() -> None:
    rooms = {path.name for path in (ROOT / "kinfmu").iterdir() if (path / "__init__.py").is_file()}
    mapped = set(re.findall(r"`kinfmu/(\w+)/", README))
    assert mapped == rooms


def test_every_module_beside_the_rooms_is_on_the_map_and_every_module_on_the_map_exists() -> None:
    modules = {path.name for path in (ROOT / "kinfmu").glob("*.py")} - {"__init__.py", "__main__.py"}
    rows = [line for line in README.splitlines() if line.startswith("| `kinfmu/")]
    assert set(re.findall(r"(\w+\.py)`", " ".join(rows))) == modules


def test_the_readme_lists_the_gallery_by_name_and_title() -> None:
    listed = re.findall(r"^\| \[`(\w+)`\]\(fmus/(\w+)/README\.md\) \| (.+?) \| .+ \|$", README, re.MULTILINE)
    assert listed == [(name, name, kinfmu.load(name).title) for name in gallery.names()]


def test_the_commands_of_the_readme_exist() -> None:
    for script in re.findall(r"scripts/(\w+)", README):
        assert (ROOT / "scripts" / script).is_file()
    commands = set(re.findall(r"^    kinfmu (\w+)", README, re.MULTILINE))
    from kinfmu.cli import main

    assert commands <= set(main.commands)


def test_the_version_is_typed_once() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "kinfmu.VERSION"}
    assert kinfmu.__version__ == kinfmu.VERSION
