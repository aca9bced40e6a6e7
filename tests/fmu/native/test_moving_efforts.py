"""Torques and loads that change in a host's step: derivatives of inputs (FMI 2.0), values inside steps (FMI 3.0)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism.laws import ConstantSpeed
from tests.fmu.host import DISCARD, ERROR, OK, Host, answer
from tests.fmu.test_torque import MECHANISMS, G

MASS, LENGTH, SPAN, PERIOD = 2.0, 0.5, 0.9, 7.0  # [kg, m, rad, rad/s]
STOP = 1.2  # [s]


def angle(t: Any) -> Any:
    return SPAN * mpmath.sin(PERIOD * t)


def torque(t: Any) -> Any:
    """The torque that swings the pendulum by SPAN: inverse dynamics, by hand."""
    inertia = MASS * LENGTH**2
    return -inertia * PERIOD**2 * angle(t) + MASS * G * LENGTH * mpmath.cos(angle(t))


@cache
def taylor(t: float) -> tuple[float, ...]:
    """The torque and its first three derivatives."""
    return tuple(float(c) * math.factorial(k) for k, c in enumerate(mpmath.taylor(torque, t, 3)))


@pytest.fixture
def start(fmu_of: Callable[..., Path], opened: Callable[..., Host]) -> Callable[..., Host]:
    def get(name: str, fmi: int, inputs_at: Callable[[float], Mapping[str, float]] | None = None, **at: float) -> Host:
        host = opened(fmu_of(MECHANISMS[name](), "native", fmi, "torque"), inputs_at=inputs_at)
        host.set({"integrator.tolerance": 1e-12, **at})
        host.initialize(0.0)
        return host

    return get


def error_of(host: Host, h: float, orders: int) -> float:
    """The error of the angle at the end, with so many derivatives of the torque given in each step."""
    for k in range(round(STOP / h)):
        value, *rates = taylor(k * h)
        host.set({"crank_torque": value})
        if orders:
            names = host.of("crank_torque") * orders
            host.fmu.setRealInputDerivatives(names, list(range(1, orders + 1)), rates[:orders])
        assert host.step(k * h, h) == OK
    return abs(host.get("crank_angle")[0] - float(angle(STOP)))


@pytest.mark.parametrize("orders", [0, 1, 2, 3])
@pytest.mark.few(2)
def test_each_derivative_raises_the_order_in_the_step_of_the_host(start: Callable[..., Host], orders: int) -> None:
    steps = (0.02, 0.01) if orders else (0.004, 0.002)
    coarse, fine = (error_of(start("pendulum", 2, crank_speed=SPAN * PERIOD), h, orders) for h in steps)
    assert math.log2(coarse / fine) == pytest.approx(orders + 1, abs=0.35)
    assert fine < 0.3 * 0.1 ** (1.5 * orders)


def test_in_fmi_3_the_host_gives_the_torque_at_every_stage(start: Callable[..., Host]) -> None:
    host = start("pendulum", 3, lambda t: {"crank_torque": float(torque(t))}, crank_speed=SPAN * PERIOD)
    for k in range(3):  # steps of 0.4 s: far longer than the torque is constant
        assert host.step(0.4 * k, 0.4) == OK
    assert host.get("crank_angle")[0] == pytest.approx(float(angle(STOP)), abs=1e-10)
    assert host.get("crank_torque")[0] == pytest.approx(float(torque(STOP)), abs=1e-12)
    alone = start("pendulum", 3, crank_speed=SPAN * PERIOD)  # without a callback inputs hold
    alone.set({"crank_torque": 1.0})
    assert alone.step(0.0, 0.4) == OK
    assert alone.get("crank_torque") == [1.0]


def test_during_a_step_only_efforts_and_loads_can_be_set(start: Callable[..., Host]) -> None:
    wrong: list[str] = ["integrator.tolerance"]
    host = start("pendulum", 3, lambda t: {"crank_torque": 0.0} if not t else dict.fromkeys(wrong, 1e-6))
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        host.set({"solver.margin": 1.0})
    assert host.step(0.0, 0.1) == OK  # the exception of the callback is the host's own
    assert (ERROR, "integrator.tolerance cannot be set during a step; efforts and external loads can") in host.messages
    assert host.get("integrator.tolerance") == [1e-12]


def test_external_loads_move_too_and_stay_at_their_last_values(start: Callable[..., Host]) -> None:
    host = start("motor", 2)
    for k in range(2):  # a state that was saved brings the derivatives back
        host.set({"wind_force": 3.0 + 20.0 * 0.1 * k, "crank_torque": 4.0})
        host.fmu.setRealInputDerivatives(host.of("wind_force"), [1], [20.0])
        saved = host.state()
        assert host.step(0.1 * k, 0.1) == OK
        (once,) = host.get("crank_speed")
        host.restore(saved)
        host.free_state(saved)
        assert host.step(0.1 * k, 0.1) == OK
        assert host.get("crank_speed") == [once]
    assert host.get("wind_force")[0] == pytest.approx(7.0, abs=1e-12)
    wind = ConstantSpeed(3.0, 20.0)
    given = {"wind_force": wind, "crank_torque": 4.0}
    run = kinfmu.simulate(MECHANISMS["motor"](), drive="torque", stop=0.2, step=0.2, tolerance=1e-12, inputs=given)
    np.testing.assert_allclose(
        host.get("crank_angle", "crank_speed"), [run["crank_angle"][-1], run["crank_speed"][-1]], rtol=1e-9
    )
    assert host.step(0.2, 0.1) == OK  # derivatives hold for one step
    assert host.get("wind_force")[0] == pytest.approx(7.0, abs=1e-12)


def test_a_discarded_step_keeps_the_inputs(start: Callable[..., Host]) -> None:
    host = start("rocker", 2)
    host.set({"crank_torque": -1.0})
    host.fmu.setRealInputDerivatives(host.of("crank_torque"), [1], [-500.0])
    assert host.step(0.0, 3.0) == DISCARD
    assert host.get("crank_torque") == [-1.0]


def test_wrong_derivatives_are_refused(start: Callable[..., Host]) -> None:
    host = start("motor", 2)
    for name, order, value in (("crank_angle", 1, 1.0), ("push.rise_2", 1, 1.0), ("crank_torque", 4, 1.0)):
        if name not in host.references:
            name = next(one for one in host.references if one.startswith("push."))
        assert answer(host.fmu.setRealInputDerivatives, host.of(name), [order], [value]) == ERROR
    assert "orders 1 to 3" in host.messages[-1][1]
