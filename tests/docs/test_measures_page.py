"""docs/measures.md: its file, its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.follow import accept, follow, page_text
from tests.docs.key_tables import with_readings


@pytest.mark.long
def test_the_page_runs_and_prints_what_it_shows(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("measures.md", tmp_path)
    report, as_json, faster = followed.outputs.values()
    section = report[report.index("  measures ") :]
    page = with_readings(page_text("measures.md"))
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{section}```", page, flags=re.DOTALL)
    accept("measures.md", followed.commented(page), request)
    assert '"measures": {' in as_json
    assert "at 6.28319 rad/s" in faster
