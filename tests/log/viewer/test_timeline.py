"""Timelines of recordings: what runs have in common."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import LogError
from kinfmu.log.viewer.timeline import timeline_of


def test_runs_over_different_axes_have_no_timeline_in_common() -> None:
    mechanism = kinfmu.load("fourbar")
    runs = [kinfmu.solve(mechanism, [0.0, 1.0]), kinfmu.solve(mechanism, crank_angle=[0.0, 1.0])]
    message = r"the runs are over t \[s\] and crank \[deg\]; runs over the same axis can be compared"
    with pytest.raises(LogError, match=f"^{message}$"):
        timeline_of(runs)


def test_values_that_a_recording_cannot_hold_are_refused() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.array([0.0, 3e9]))
    with pytest.raises(LogError, match=r"^crank \[rad\]: a recording holds values of at most 2147483648$"):
        timeline_of([run])
