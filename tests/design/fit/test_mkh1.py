"""The benchmark mkh1 in short: from a mechanism near its best optimum; `scripts/test tests/stress` has the whole."""

from __future__ import annotations

import pytest

import kinfmu
from tests.design.fit.mkh1 import BEST, mkh1


def test_the_best_optimum_is_found_from_near_it() -> None:
    result = kinfmu.fit(mkh1(within=0.2), starts=1, engine="python")

    assert result.squares == pytest.approx(BEST, abs=1e-11)
    assert result.squares < 0.0091150  # the best published one
