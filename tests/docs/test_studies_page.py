"""docs/studies.md: its files, commands and Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.follow import accept, files, follow, page_text


def test_the_page_runs_and_prints_what_it_shows(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    assert list(files("studies.md")) == ["hoeken.toml", "tolerances.toml", "lengths.toml"]
    followed = follow("studies.md", tmp_path)
    report, on_a_grid, _ = followed.outputs.values()
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{report}```", page_text("studies.md"), flags=re.DOTALL)
    accept("studies.md", followed.commented(page), request)
    assert "42 designs (on a grid)" in on_a_grid
    made = {path.name for path in tmp_path.iterdir()}
    assert {"tolerances.svg", "lengths.png", "swing.svg", "tolerances.parquet", "lengths.parquet"} <= made
