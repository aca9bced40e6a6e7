"""Hosts that round up, down or to zero: a Python FMU is right all the same, a native one refuses in one line."""

from __future__ import annotations

import ctypes
import ctypes.util
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from tests.fmu.host import ERROR, OK, Host, answer

MODES = {"down": 0x400, "up": 0x800, "zero": 0xC00}  # FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO
LIBRARY = ctypes.util.find_library("m")
pytestmark = pytest.mark.skipif(
    platform.machine() != "x86_64" or not LIBRARY, reason="the numbers of the rounding modes are those of x86-64"
)
REFUSAL = "the host does not round to nearest; call fesetround(FE_TONEAREST) before the FMU"
Opened = Callable[..., Host]


@contextmanager
def rounding(mode: str) -> Iterator[None]:
    """Round as `mode` says, also in what Python computes."""
    library = ctypes.CDLL(LIBRARY)
    library.fesetround(MODES[mode])
    try:
        yield
    finally:
        library.fesetround(0)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.few(3)
def test_a_native_fmu_refuses_and_goes_on_once_the_host_rounds_to_nearest(
    mode: str, fmi: int, fmu_of: Callable[..., Path], opened: Opened
) -> None:
    host = opened(fmu_of("crank_rocker", "native", fmi, "inputs"))
    with rounding(mode):
        found = [answer(host.enter, 0.0)]
    host.enter(0.0)
    with rounding(mode):
        found.append(answer(host.fmu.exitInitializationMode))
    host.fmu.exitInitializationMode()
    with rounding(mode):
        found += [answer(host.set, {"crank_angle": 1.0}), host.step(0.0, 0.1)]
    assert found == 4 * [ERROR]
    assert {text for _, text in host.messages} == {REFUSAL}
    host.set({"crank_angle": 1.0})
    assert host.step(0.0, 0.1) == OK
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=[1.0])
    np.testing.assert_allclose(host.get(*run.names), run.q[0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", ["crank_rocker", "fourbar"])
@pytest.mark.few(3)
def test_a_python_fmu_is_right_in_every_rounding_mode(
    mode: str, name: str, fmu_of: Callable[..., Path], opened: Opened
) -> None:
    """Its sines and cosines are the C library's, which are right in all of them."""
    t = 0.05 * np.arange(80)
    run = kinfmu.solve(kinfmu.load(name), t=t)
    host = opened(fmu_of(name))
    rows, statuses = [], []
    with rounding(mode):
        host.initialize(0.0)
        for time in t.tolist():
            rows.append(host.get(*run.names))
            statuses.append(host.status())
            assert host.step(time, 0.05) == OK
    np.testing.assert_allclose(rows, run.q, rtol=0, atol=1e-13 * max(1.0, np.abs(run.q).max()))
    assert statuses == run.status.tolist()
