"""The random host of FMUs: two instances in two threads, FMI 3.0, efforts as inputs; test_fuzz.py tries another one."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import fmu
from tests.fuzz.summary import Summary

TORQUE = [seed for seed, variant in enumerate(fmu.VARIANTS) if variant.drive == "torque"]


@pytest.mark.parametrize(
    "seed",
    [1, 2, *(pytest.param(seed, marks=pytest.mark.long) for seed in TORQUE)],
    ids=lambda seed: str(fmu.VARIANTS[seed]),
)
@pytest.mark.few(1)
def test_no_call_of_fmi_does_harm(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if seed not in TORQUE:  # where single calls are slow: the integrator's steps follow from the numbers given
        monkeypatch.setattr(fmu, "CALLS", 3000)
    summary = Summary("fmu")
    for again in range(3):
        fmu.trial(seed + again * len(fmu.VARIANTS), tmp_path, summary)
    assert summary.tried.total() == 3
    assert summary.findings == [], "\n".join(summary.lines())
