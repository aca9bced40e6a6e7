"""Long runs of random repeating laws in short."""

from __future__ import annotations

from typing import Literal

import pytest

from tests.stress.repeating import compared


@pytest.mark.parametrize(("engine", "count"), [("python", 100), ("native", 20)])
def test_a_repeating_law_is_exact_after_up_to_a_million_periods(
    engine: Literal["python", "native"], count: int
) -> None:
    faults = [(seed, fault) for seed in range(count) for fault in compared(seed, engine).faults]
    assert faults == [], f"python -m tests.stress.repeating --engine {engine}"
