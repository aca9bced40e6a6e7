"""docs/playing.md: its commands and its Python run."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.follow import follow


@pytest.mark.long
def test_the_page_runs_and_the_live_mechanism_has_the_length_of_the_page(tmp_path: Path) -> None:
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    pytest.importorskip("ziglang", reason="pages are compiled by zig")
    live = follow("playing.md", tmp_path).names["live"]
    assert live.parameters.m == 14.5
    assert live.values["crank.speed"] > 0.0
