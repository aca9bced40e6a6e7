"""docs/designing.md: its commands and its Python run, and print what the page shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.follow import accept, follow, page_text


@pytest.mark.long
def test_the_page_runs_and_prints_its_comments(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    accept("designing.md", follow("designing.md", tmp_path).commented(page_text("designing.md")), request)
