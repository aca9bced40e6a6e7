"""Commands that pages show."""

from __future__ import annotations

import re

from kinfmu.cli import main


def check_commands(page: str) -> None:
    """Assert that the commands of the page's indented blocks exist, with their options."""
    lines = re.findall(r"^    kinfmu ([^#\n]+)", page, re.MULTILINE)
    assert len(lines) >= 3
    for line in lines:
        command, *words = line.split()
        known = {name for option in main.commands[command].params for name in option.opts}
        assert {word.partition("=")[0] for word in words if re.match("--?[a-z]", word)} <= known, line
