"""Arrows of reactions: their directions balance a body, their scale is that of the legend."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.run import Run
from kinfmu.scene.forces import LONGEST, arrows
from kinfmu.scene.scene import scene
from tests.sweep.test_forces import loaded


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(loaded("slider_crank"))


def test_arrows_are_the_forces_to_the_scale_of_the_legend(run: Run) -> None:
    assert run.mechanism is not None
    shown = scene(run, run.mechanism)
    found = arrows(run, run.mechanism, shown)
    assert found is not None
    assert set(found.along) == {"O", "P", "S", "bore"}
    newtons = found.along["P"] * found.newton / found.length
    np.testing.assert_allclose(newtons, np.column_stack([run["P.force_x"], run["P.force_y"]]), rtol=1e-12)
    bore = found.along["bore"] * found.newton / found.length
    np.testing.assert_allclose(bore[:, 0], 0.0, atol=1e-12)  # the bore is along x
    np.testing.assert_allclose(bore[:, 1], run["bore.force"], rtol=1e-12)
    np.testing.assert_allclose(found.at["P"], np.column_stack([run["rod.x"], run["rod.y"]]), atol=1e-9)
    longest = max(float(np.hypot(*along.T).max()) for along in found.along.values())
    assert longest == pytest.approx(LONGEST * shown.size, rel=0.02)
    assert found.legend == "1000 N"


def test_undetermined_reactions_and_those_not_kept_have_no_arrow(run: Run) -> None:
    fourbar = kinfmu.solve(loaded("fourbar"), np.arange(5.0))
    assert fourbar.mechanism is not None
    assert run.mechanism is not None
    assert arrows(fourbar, fourbar.mechanism, scene(fourbar, fourbar.mechanism)) is None
    part = run.without(["P.force_x"])
    found = arrows(part, run.mechanism, scene(part, run.mechanism))
    assert found is not None
    assert set(found.along) == {"O", "S", "bore"}
