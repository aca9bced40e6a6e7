"""The hostile suite in short: some seconds of each part."""

from __future__ import annotations

import pytest

from tests.fuzz.parts import PARTS, run

SECONDS = 1.5  # of each part; scripts/fuzz goes on for longer


@pytest.mark.parametrize("part", PARTS)
def test_hostile_input_of_each_part_has_no_findings(part: str) -> None:
    summary = run(part, 0, SECONDS)
    assert summary.tried.total() > 0
    assert summary.findings == [], "\n".join(summary.lines())
