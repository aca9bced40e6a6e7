"""scripts/words.py: words that plain ones replace are found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

RULES = [line for line in (ROOT / "scripts" / "words.txt").read_text("utf-8").splitlines() if line[:1] not in "#"]


@pytest.mark.parametrize(
    "text",
    [
        "if nothing is said, 0",
        "start and speed must be said",
        "parameters that cannot be had",
        "a sample is told outside",
        "the message tells the driver",
        "hands on what it gets",
        "columns parted by commas",
        "both sides are alike",
        "1e-13 (fine)",
        "class Road:",
        "def _close_beside(pose):",
        "is_number said so",
    ],
)
def test_an_archaic_phrase_is_found(text: str) -> None:
    patterns = [rule.rsplit(" => ", 1)[0] for rule in RULES]
    assert any(re.search(pattern, text) for pattern in patterns)


@pytest.mark.parametrize("text", ["the default is 0", "room for n numbers", "the road ahead", "later, kept samples"])
def test_a_plain_phrase_is_not(text: str) -> None:
    patterns = [rule.rsplit(" => ", 1)[0] for rule in RULES]
    assert not any(re.search(pattern, text) for pattern in patterns)
