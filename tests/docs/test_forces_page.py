"""docs/forces.md: its file, its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.follow import accept, follow, page_text


@pytest.mark.long
def test_the_page_runs_and_prints_what_it_shows(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("forces.md", tmp_path)
    report = followed.outputs["kinfmu check pump.toml"]
    section = report[report.index("  forces ") :]
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{section}```", page_text("forces.md"), flags=re.DOTALL)
    accept("forces.md", followed.commented(page), request)
    faster = followed.outputs["kinfmu check pump.toml --set piston_mass=1.2kg --set crank.speed=600rpm"]
    assert "at 62.8319 rad/s" in faster
    assert ",crank.torque," in (tmp_path / "pump.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert (tmp_path / "pump.svg").is_file()
