"""Processes that round up, down or to zero: the Python engine is right there, the native one is not used."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import RequestError
from kinfmu.run import model
from tests.fmu.test_rounding import MODES, pytestmark, rounding

__all__ = ["pytestmark"]  # skips all tests where the numbers of the modes are others


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.few(1)
def test_the_native_engine_refuses_and_auto_takes_the_python_engine(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "WORTH_COMPILING", 1)
    mechanism, t = kinfmu.load("crank_rocker"), np.linspace(0.0, 3.0, 100)
    exact = kinfmu.solve(mechanism, t, engine="native")
    with rounding(mode):
        run = kinfmu.solve(mechanism, t)
        with pytest.raises(RequestError, match=r"^engine 'native' needs rounding to nearest; call fesetround"):
            kinfmu.solve(mechanism, t, engine="native")
    assert run.good.all()
    np.testing.assert_allclose(run.q, exact.q, rtol=0, atol=1e-12)
