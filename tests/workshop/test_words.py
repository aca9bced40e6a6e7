"""scripts/words.py: words that plain ones replace are found."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CHECKER = runpy.run_path(str(ROOT / "scripts" / "words.py"))


def is_refused(text: str) -> bool:
    return any(CHECKER["found_in"](pattern, text) for pattern, _ in CHECKER["rules"]())


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
        "def test_a_rank_is_restored_beside_it() -> None:",
        "def test_times_and_inputs_drive_alike() -> None:",
        "reported_or_said_to_be_ambiguous",
        "const isToBeHad = 1;",
        "test_angles_go_the_short_way",
        "10  # trials handed to a process",
        "joint B is open by 82 mm",
    ],
)
def test_an_archaic_phrase_is_found(text: str) -> None:
    assert is_refused(text)


@pytest.mark.parametrize(
    "text", ["the default is 0", "room for n numbers", "the road ahead", "later, kept samples", "isKept(a)", "ROOM(n)"]
)
def test_a_plain_phrase_is_not(text: str) -> None:
    assert not is_refused(text)


@pytest.mark.parametrize("ending", [".py", ".c", ".js", ".html", ".css", ".md"])
def test_files_of_every_language_are_read(ending: str) -> None:
    assert ending in CHECKER["ENDINGS"]
