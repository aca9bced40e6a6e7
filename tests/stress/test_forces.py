"""Forces of random mechanisms against free-body diagrams in 50 digits; at length: `python -m tests.stress.forces`."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

from kinfmu.run.forces import ForceModel
from tests.stress.forces import ENERGY, WRONG, compared

FEW = {
    "four-bars": 1,
    "slider-cranks": 2,
    "pins in slots": 3,
    "watt six-bars": 4,
    "geared five-bars": 5,
    "redundant parallelograms": 6,
    "coupled wheels": 7,
    "cylinders": 8,
    "robots": 9,
}


@pytest.mark.parametrize(("family", "seed"), FEW.items())
@pytest.mark.parametrize("engine", ["python", "native"])
def test_forces_agree_with_50_digits(family: str, seed: int, engine: Literal["python", "native"]) -> None:
    found = compared(seed, family, engine)
    assert found.faults == []
    assert found.samples > 0
    assert found.stretches > 0
    assert max(found.efforts, found.inertias, found.reactions, found.balance, found.shaking) <= WRONG
    assert found.energy <= ENERGY


@pytest.mark.parametrize("method", ["forces", "reactions"])
def test_wrong_forces_are_reported(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    right = getattr(ForceModel, method)
    monkeypatch.setattr(ForceModel, method, lambda model, run: right(model, run) * (1.0 + 1e-9))
    faults = compared(1, "four-bars").faults
    for what in {"forces": ["efforts"], "reactions": ["reactions", "shaking force"]}[method]:
        assert any(f"{what} wrong by" in fault for fault in faults)


def test_reactions_that_are_not_determined_may_not_be_given(monkeypatch: pytest.MonkeyPatch) -> None:
    right = ForceModel.reactions

    def invented(model: ForceModel, run: Any) -> Any:
        return np.nan_to_num(right(model, run))

    monkeypatch.setattr(ForceModel, "reactions", invented)
    faults = compared(7, "coupled wheels").faults
    assert any("a self-stress may be added" in fault for fault in faults)
