"""docs/playing.md: its commands exist, its Python runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from tests.docs.commands import check_commands

PAGE = (Path(__file__).parents[2] / "docs" / "playing.md").read_text(encoding="utf-8")


def test_every_command_and_option_of_the_page_exists() -> None:
    check_commands(PAGE)


def test_the_python_of_the_page_runs() -> None:
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    pytest.importorskip("ziglang", reason="pages are compiled by zig")
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(block, "playing.md", "exec"), names)  # noqa: S102  our own page
    assert names["live"].parameters.m == 14.5
    assert names["live"].values["crank.speed"] > 0.0
