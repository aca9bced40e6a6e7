"""The random host of FMUs: two instances in two threads, and FMI 3.0, in addition to what test_fuzz.py tries."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import fmu
from tests.fuzz.summary import Summary


@pytest.mark.parametrize("seed", [1, 2], ids=lambda seed: str(fmu.VARIANTS[seed]))
def test_no_call_of_fmi_does_harm(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu, "CALLS", 3000)
    summary = Summary("fmu")
    for again in range(3):
        fmu.trial(seed + again * len(fmu.VARIANTS), tmp_path, summary)
    assert summary.tried.total() == 3
    assert summary.findings == [], "\n".join(summary.lines())
