"""Sensitivities of random mechanisms against 50 digits; at length: `python -m tests.stress.sensitivities`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from kinfmu import Model
from kinfmu.run.sensitivities import Sensitivities
from tests.stress.sensitivities import WRONG, Engine, compared

FEW = {
    "four-bars": 0,
    "pins in slots": 5,
    "watt six-bars": 6,
    "geared five-bars": 10,
    "redundant parallelograms": 26,
    "cylinders": 16,
}


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(("family", "seed"), FEW.items())
def test_sensitivities_agree_with_50_digits(family: str, seed: int, engine: Engine) -> None:
    found = compared(seed, family, engine)
    assert found.faults == []
    assert found.compared > 0
    assert found.worst <= WRONG


def test_wrong_derivatives_and_wrong_refusals_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Model.sensitivities

    def changed(model: Model, *given: Any, **named: Any) -> Sensitivities:
        found = right(model, *given, **named)
        refused: Mapping[str, str] = {found.parameters[0]: "no reason"}
        return replace(found, rates_by=found.rates_by + 1e-9, refused=refused)

    monkeypatch.setattr(Model, "sensitivities", changed)
    faults = compared(0, "four-bars", "python").faults
    assert "is refused, but no row opens: no reason" in faults[0] + faults[-1]
    assert sum("is wrong by" in fault for fault in faults) >= 6
