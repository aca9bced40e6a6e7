"""docs/coupling.md: its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.blocks import DOCS
from tests.docs.follow import accept, follow, page_text, typed

PAGE = page_text("coupling.md")


@pytest.mark.long
def test_the_page_runs_and_prints_its_comments(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("coupling.md", tmp_path)
    accept("coupling.md", followed.commented(PAGE), request)
    assert "current [A]" in (tmp_path / "drive.svg").read_text(encoding="utf-8")


@pytest.mark.long
def test_constants_and_the_message_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typed("python examples/dc_motor/build.py drive")
    command = [
        "simulate",
        "drive/press_drive.ssp",
        "--set",
        "motor.voltage=600 V",
        "--stop",
        "0.05",
        "--mcap",
        "a.mcap",
    ]
    result = CliRunner().invoke(main, [*command, "--channels", "signals", "--exchange", "jacobi"])
    assert result.exit_code == 0, result.output
    (message,) = re.findall(r"^kinfmu: drive\.ssp: (connection .*)$", PAGE, re.MULTILINE)
    with zipfile.ZipFile("drive/press_drive.ssp") as old, zipfile.ZipFile("drive.ssp", "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b'endConnector="crank_angle"', b'endConnector="crank_speed"'))
    result = CliRunner().invoke(main, ["simulate", "drive.ssp"])
    assert result.exit_code == 1
    assert result.output.splitlines()[-1].endswith(message)
    assert "logs" not in {path.name for path in tmp_path.iterdir()} or not list((tmp_path / "logs").iterdir())


@pytest.mark.long
def test_the_figure_is_the_one_that_its_command_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typed("python examples/dc_motor/stability.py F.svg")
    drawn, committed = (path.read_text(encoding="utf-8") for path in (Path("F.svg"), DOCS / "drive-coupling.svg"))
    labels = re.compile(r"<!-- (.*?) -->|<text[^>]*>([^<]*)|<(use)")
    assert len(labels.findall(committed)) > 50
    assert labels.findall(drawn) == labels.findall(committed)
