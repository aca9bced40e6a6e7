"""Runs of the four-bar as fixtures."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.run import Run
from tests.log.runs import fourbar, with_gap


@pytest.fixture
def run() -> Run:
    """0 to 180 s in steps of 1 s."""
    return fourbar(np.arange(181.0))


@pytest.fixture
def run_with_gap(run: Run) -> Run:
    return with_gap(run, 100, 120)
