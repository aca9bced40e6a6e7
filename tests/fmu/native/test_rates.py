"""Parameter `rates`, the order of estimated rates, and solver.ok: the same in every flavour and version."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

from kinfmu.errors import RequestError
from kinfmu.fmu import simulate
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from tests.fmu.conftest import Build
from tests.fmu.host import OK, Host

INPUTS = ("crank_angle", "crank_speed", "crank_acceleration")
FLAVOURS = ("python", "native 2", "native 3")
Start = Callable[..., Host]


@pytest.fixture(scope="module")
def paths(built: Build, built_native: Build) -> Callable[[str, str], Path]:
    """`paths(flavour, name)`: an FMU that inputs drive."""

    def get(flavour: str, name: str) -> Path:
        return built(name, "inputs") if flavour == "python" else built_native(name, int(flavour[-1]), "inputs")

    return get


@pytest.fixture(params=FLAVOURS)
def start(request: pytest.FixtureRequest, paths: Callable[[str, str], Path], opened: Start) -> Start:
    """`start(name, rates, before)`: a slave; before: inputs that are set before `rates` is."""

    def get(name: str = "fourbar", rates: Rates | None = None, before: dict[str, float] | None = None) -> Any:
        host = opened(paths(request.param, name))
        host.set(before or {})
        if rates is not None:
            host.set({"rates": rates})
        host.initialize(0.0)
        return host

    return get


def steps(host: Any, t: float, h: float) -> bool:
    return host.step(t, h) == OK


def mode(host: Any) -> int:
    is_old = host.is_python or host.fmi == 2
    read = host.fmu.getInteger if is_old else host.fmu.getInt64
    return int(read([host.references["rates"]])[0])


def ok(host: Any) -> bool:
    return bool(host.fmu.getBoolean([host.references["solver.ok"]])[0])


def motion(order: int, t: float) -> float:
    """Derivative of the given order of u = 1 + 0.3 sin 2 t."""
    return (order == 0) + 0.3 * 2.0**order * math.sin(2.0 * t + 0.5 * math.pi * order)


# Where rates come from


def test_constant_zero_is_wired_with_rates_wired(start: Start) -> None:
    host = start(rates=Rates.WIRED)
    assert mode(host) == Rates.WIRED
    for k in range(5):
        host.set({"crank_angle": 0.5 * k, "crank_speed": 0.0})
        assert host.get("crank.omega", "crank.alpha", "coupler.vx") == [0.0, 0.0, 0.0]
        assert max(host.get("solver.error_qd", "solver.error_qdd")) < 1e-12
        assert steps(host, 0.1 * k, 0.1)
    host.set({"crank_angle": 1.0, "crank_speed": 2.0})
    assert host.get("crank.omega", "driven.crank_acceleration") == [2.0, 0.0]


def test_estimated_rates_ignore_the_inputs_of_rates(start: Start) -> None:
    host, plain = start(rates=Rates.ESTIMATED, before={"crank_speed": 3.0}), start()
    for k in range(6):
        for one in (host, plain):
            one.set({"crank_angle": motion(0, 0.1 * k)})
        host.set({"crank_speed": 50.0, "crank_acceleration": -7.0 * k})
        for _ in range(2):
            assert host.outputs() == plain.outputs()
            assert steps(host, 0.1 * k, 0.1) == steps(plain, 0.1 * k, 0.1) is True


def test_default_is_auto_whatever_is_set_first(start: Start) -> None:
    assert mode(start()) == Rates.AUTO
    for host in (start(rates=Rates.AUTO, before={"crank_speed": 2.0}), start(before={"crank_speed": 2.0})):
        assert host.get("crank.omega") == [2.0]
        host.set({"crank_speed": 0.0})
        assert host.get("crank.omega") == [0.0]


def test_the_choice_is_part_of_the_state(start: Start) -> None:
    host, other = start(rates=Rates.WIRED), start()
    other.restore(other.deserialize(host.serialize(host.state())))
    assert mode(other) == Rates.WIRED
    for k in range(3):
        other.set({"crank_angle": 0.5 * k})
        assert steps(other, 0.1 * k, 0.1)
    assert other.get("crank.omega") == [0.0]


@pytest.mark.parametrize("value", [-1, 3, 1000])
def test_invalid_values_are_refused(start: Start, value: int) -> None:
    host = start(rates=Rates.ESTIMATED)
    try:
        host.set({"rates": value})
    except FMICallException:
        assert not host.is_python
    assert f"rates = {value} must be 0 (auto), 1 (estimated) or 2 (wired); 1 stays" in host.messages[-1][1]
    assert mode(host) == Rates.ESTIMATED


def test_the_choice_is_fixed_once_initialized(start: Start) -> None:
    host = start()
    try:
        host.set({"rates": Rates.WIRED})
    except FMICallException:
        assert not host.is_python
    assert "rates = 2 comes too late: it is fixed once the FMU is initialized" in host.messages[-1][1]
    assert mode(host) == Rates.AUTO


def test_model_exchange_always_takes_the_inputs(paths: Callable[[str, str], Path], opened: Start) -> None:
    for fmi in (2, 3):
        host = opened(paths(f"native {fmi}", "fourbar"), model_exchange=True)
        host.set({"rates": Rates.ESTIMATED, "crank_speed": 3.0})
        host.initialize(0.0)
        assert host.get("crank.omega") == [3.0]


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_simulate_takes_the_choice_by_name(paths: Callable[[str, str], Path], flavour: str) -> None:
    path = paths(flavour, "fourbar")
    table = {"time": [0.0, 1.0], "crank_angle": [0.0, 1.0], "crank_speed": [0.0, 0.0]}
    omega = {
        rates: simulate(path, stop=1.0, step=0.25, inputs=table, parameters={"rates": rates})["crank.omega"][-1]
        for rates in ("wired", "estimated", "auto", 2)
    }
    assert omega == {"wired": 0.0, "estimated": pytest.approx(1.0), "auto": pytest.approx(1.0), 2: 0.0}
    with pytest.raises(RequestError, match=r"rates = 'wire' must be auto, estimated or wired"):
        simulate(path, inputs=table, parameters={"rates": "wire"})


# Orders


GRIDS: dict[str, Callable[[int], float]] = {  # time of sample k in steps, strictly increasing
    "even": float,
    "uneven": lambda k: k + 0.3 * math.sin(2.0 * k),
    "two sizes": lambda k: k + 0.4 * (k % 2),
}


def _errors(host: Any, grid: Callable[[int], float], h: float) -> tuple[float, float]:
    """Largest errors of speed and acceleration over 0.6 s at the samples, before and after their steps."""
    speed = acceleration = 0.0
    times = [h * grid(k) for k in range(round(0.6 / h))]
    for k, t in enumerate(times[:-1]):
        host.set({"crank_angle": motion(0, t)})
        for is_committed in (False, True):
            if is_committed:
                assert steps(host, t, times[k + 1] - t)
            omega, alpha = host.get("crank.omega", "crank.alpha")
            if k > 2:
                speed = max(speed, abs(omega - motion(1, t)))
                acceleration = max(acceleration, abs(alpha - motion(2, t)))
    return speed, acceleration


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.few(5)
def test_estimates_are_of_order_2_for_speeds_and_1_for_accelerations_on_any_grid(start: Start, grid: str) -> None:
    coarse, fine = (_errors(start(), GRIDS[grid], h) for h in (0.01, 0.0025))
    orders = [math.log(a / b, 4.0) for a, b in zip(coarse, fine, strict=True)]
    assert orders == pytest.approx([2.0, 1.0], abs=0.1)


def test_the_first_samples_have_lower_orders_and_unknown_errors(start: Start) -> None:
    host = start()
    wanted = ([0.0, 0.0], [0.6, 0.0])  # at rest, then the slope
    unknown = ([True, True], [True, True], [False, True], [False, False])
    for k in range(4):
        t = 0.001 * k
        host.set({"crank_angle": motion(0, t)})
        if k < 2:
            assert host.get("crank.omega", "crank.alpha") == pytest.approx(wanted[k], abs=1e-3)
        errors = host.get("solver.error_qd", "solver.error_qdd")
        assert [error == UNKNOWN_ERROR for error in errors] == unknown[k]
        assert steps(host, t, 0.001)


@pytest.mark.parametrize("repeats", [1, 3])
def test_steps_that_are_taken_back_leave_no_trace_in_estimates(start: Start, repeats: int) -> None:
    """A master that tries steps of several sizes from one point, without states, in the last digits of its clock."""
    straight, back = start(), start()
    for k in range(8):
        t = 0.1 * k
        for host in (straight, back):
            for trial in range(repeats if host is back else 0):
                host.set({"crank_angle": motion(0, t) + 0.01 * trial})
                assert steps(host, math.nextafter(t, 9.0 * (trial % 2)), 0.1 / 2**trial)
            host.set({"crank_angle": motion(0, t)})
            assert steps(host, t, 0.1)
        names = ("crank.phi", "crank.omega", "crank.alpha", "rocker.omega", "solver.error_qd", "solver.error_qdd")
        assert back.get(*names) == pytest.approx(straight.get(*names), rel=1e-9, abs=1e-12)


# solver.ok


def test_ok_is_true_for_a_status_of_0_to_2(start: Start) -> None:
    host = start("double_pendulum")
    for angle, wanted in ((5.3, True), (6.2, True), (6.5, False), (2.0, False), (6.2, True), (2 * math.pi, True)):
        host.set({"crank_angle": angle})
        assert ok(host) is wanted
        assert (host.status() <= 2) is wanted
    host.set({"crank_angle": 6.5})
    assert not steps(host, 0.0, 0.1)
    assert not ok(host)
    host.set({"crank_angle": 6.1})
    assert steps(host, 0.0, 0.1)
    assert ok(host)
