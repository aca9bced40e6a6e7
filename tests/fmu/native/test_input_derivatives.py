"""Derivatives of inputs (FMI 2.0): they move the inputs over a step, and they are the rates of the drivers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from kinfmu.fmu.slave.estimated_rates import Rates
from tests.fmu.conftest import Build
from tests.fmu.host import DISCARD, OK, Host
from tests.fmu.test_estimated_rates import (  # with native FMUs
    test_point_that_is_stepped_again_replaces_its_sample as test_point_that_is_stepped_again_replaces_its_sample,
)

H = 0.01  # [s]
QUANTITIES = ("length", "speed", "acceleration")
Give = Callable[[float], list[float]]


def motion(order: int, t: float) -> float:
    """Derivative of the given order of u = 1 + 0.3 sin 2 t."""
    return (order == 0) + 0.3 * 2.0**order * math.sin(2.0 * t + 0.5 * math.pi * order)


GIVEN: dict[str, Give] = {  # what a master gives at t: derivatives of order 1, 2, ...
    "first": lambda t: [motion(1, t)],
    "second": lambda t: [motion(1, t), motion(2, t)],
    "third": lambda t: [motion(1, t), motion(2, t), motion(3, t)],
    "slope behind": lambda t: [(motion(0, t) - motion(0, t - H)) / H],
    "slope ahead": lambda t: [(motion(0, t + H) - motion(0, t)) / H],
}
BOUNDS = {  # of the errors of angle, speed and acceleration at the end of a step, from the first term that is missing
    "first": (0.6 * H**2, 1.2 * H, 2 * 2.4 * H),
    "second": (2.4 / 6 * H**3, 2.4 / 2 * H**2, 2.4 * H),
    "third": (4.8 / 24 * H**4, 4.8 / 6 * H**3, 4.8 / 2 * H**2),
    "slope behind": (1.2 * H**2, 1.8 * H, 2 * 2.4 * H),
    "slope ahead": (1e-14, 0.6 * H, 2 * 2.4 * H),
}
CLOCKS: dict[str, Callable[[float], Iterator[float]]] = {  # equal times in different last digits
    "multiplied": lambda t0: (t0 + k * H for k in itertools.count()),
    "added": lambda t0: itertools.accumulate(itertools.repeat(H), initial=t0),
    "last digits differ": lambda t0: (
        math.nextafter(t0 + k * H, math.inf if k % 2 else -math.inf) for k in itertools.count()
    ),
}


@pytest.fixture
def start(built_native: Build, opened: Callable[..., Host]) -> Callable[..., Host]:
    """`start(name, t)`: a slave of FMI 2.0 that is driven by inputs, initialized at time t."""

    def get(name: str = "fourbar", t: float = 0.0) -> Host:
        host = opened(built_native(name, 2, "inputs"))
        host.initialize(t)
        return host

    return get


def give(host: Host, name: str, derivatives: list[float]) -> None:
    """Derivatives of an input, of order 1, 2, ..."""
    count = len(derivatives)
    host.fmu.setRealInputDerivatives(host.of(name) * count, list(range(1, count + 1)), derivatives)


@pytest.mark.parametrize("t0", [0.0, 1000.0])
@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.few(12)
def test_given_derivatives_are_the_rates_whatever_the_clock(
    start: Callable[..., Host], given: str, clock: str, t0: float
) -> None:
    host = start("fourbar", t0)
    for k, t in enumerate(itertools.islice(CLOCKS[clock](t0), 60)):
        host.set({"crank_angle": motion(0, t)})
        estimated = host.get("crank.omega", "crank.alpha")  # no derivative holds yet at t: estimates of three samples
        derivatives = GIVEN[given](t)
        give(host, "crank_angle", derivatives)
        assert host.get("crank.phi") == [motion(0, t)]
        assert host.get("crank.omega", "crank.alpha")[: len(derivatives)] == derivatives[:2]
        assert host.step(t, H) == OK
        assert host.status() == 0
        if k >= 3:
            end = t + H
            assert abs(estimated[0] - motion(1, t)) < 1.1 * H**2  # 2.4 / 3 H^2 and the next term
            assert abs(estimated[1] - motion(2, t)) < 1.1 * 2.4 * H
            for order, bound in enumerate(BOUNDS[given]):
                (value,) = host.get(("crank.phi", "crank.omega", "crank.alpha")[order])
                assert abs(value - motion(order, end)) < 1.1 * bound + 4e-16 * t0 / H


def test_position_and_rates_at_the_end_of_a_step_are_those_of_the_polynomial(start: Callable[..., Host]) -> None:
    host = start()
    host.set({"crank_angle": 0.3})
    give(host, "crank_angle", [2.0, 4.0, -6.0])
    assert host.step(0.0, 0.1) == OK
    assert host.get("crank_angle", "crank.phi") == pytest.approx([0.519, 0.519], abs=1e-15)
    assert host.get("crank.omega", "crank.alpha") == pytest.approx([2.37, 3.4], abs=1e-14)
    c, s = math.cos(0.519), math.sin(0.519)
    assert host.get("coupler.vx", "coupler.ax") == pytest.approx([-2.37 * s, -3.4 * s - 2.37**2 * c], abs=1e-13)
    assert host.get("solver.error_qd", "solver.error_qdd") == pytest.approx([0.0, 0.0], abs=1e-12)


def test_drivers_without_derivatives_are_estimated_also_if_others_have_them(start: Callable[..., Host]) -> None:
    host = start("five_bar")
    (left, right) = host.get("left_angle", "right_angle")
    for k in range(6):
        t = 0.1 * k
        host.set({"left_angle": left + 0.2 * t, "right_angle": right + 0.1 * t * t})
        give(host, "left_angle", [0.2])
        assert host.step(t, 0.1) == OK
        rates = host.get("driven.left_speed", "driven.right_speed", "driven.right_acceleration")
        if k >= 2:  # the right driver is held over the step; what is estimated follows its samples
            assert rates == pytest.approx([0.2, 0.2 * (t + 0.1), 0.2], abs=1e-10)


def test_derivatives_of_a_speed_that_is_wired_are_the_acceleration(start: Callable[..., Host]) -> None:
    host = start()
    host.set({"crank_angle": 0.3, "crank_speed": 0.0})
    give(host, "crank_angle", [0.0, 5.0])
    give(host, "crank_speed", [5.0])
    assert host.get("crank.omega", "crank.alpha") == [0.0, 5.0]  # wired: its derivative is not 0
    assert host.step(0.0, 0.1) == OK
    assert host.get("crank_speed", "crank.omega", "crank.alpha") == pytest.approx([0.5, 0.5, 5.0], abs=1e-15)


def test_derivatives_hold_for_one_step_and_are_forgotten_by_reset(start: Callable[..., Host]) -> None:
    host = start()
    for k in range(4):
        host.set({"crank_angle": 0.3 + 0.01 * k})
        give(host, "crank_angle", [7.0])
        assert host.step(H * k, H) == OK
        assert host.get("crank.omega") == [7.0]
    host.set({"crank_angle": 0.34})
    assert host.get("crank.omega") == pytest.approx([1.0])
    assert host.step(4 * H, H) == OK
    assert host.get("crank.phi", "crank.omega") == pytest.approx([0.34, 1.0])
    give(host, "crank_angle", [7.0])
    host.fmu.reset()
    host.initialize(0.0)
    assert host.step(0.0, H) == OK
    assert host.get("crank.omega") == [0.0]


def test_extrapolated_values_are_not_samples_of_later_estimates(start: Callable[..., Host]) -> None:
    """A master that extrapolates badly for a while, and then gives values alone."""
    host, plain = start(), start()
    for k in range(12):
        t = H * k
        for one in (host, plain):
            one.set({"crank_angle": motion(0, t)})
        if k < 8:
            give(host, "crank_angle", [50.0])
        assert host.step(t, H) == plain.step(t, H) == OK
    for one in (host, plain):
        one.set({"crank_angle": motion(0, 12 * H)})
    names = ("crank.omega", "crank.alpha", "coupler.ax")
    assert host.get(*names) == pytest.approx(plain.get(*names), abs=1e-9)


def test_state_in_the_middle_of_extrapolated_steps_goes_back_bit_by_bit(start: Callable[..., Host]) -> None:
    host, other = start(), start()

    def go(one: Host, first: int, last: int) -> list[list[float]]:
        rows = []
        for k in range(first, last):
            t = H * k
            one.set({"crank_angle": motion(0, t)})
            give(one, "crank_angle", GIVEN["slope behind"](t))
            rows.append(one.outputs())
            assert one.step(t, H) == OK
            rows.append(one.outputs())
        return rows

    go(host, 0, 5)
    state = host.state()
    wanted = [host.outputs(), *go(host, 5, 9)]
    host.restore(state)
    assert [host.outputs(), *go(host, 5, 9)] == wanted
    other.restore(other.deserialize(host.serialize(state)))
    assert [other.outputs(), *go(other, 5, 9)] == wanted
    host.restore(state)  # derivatives that wait for their step are part of the state
    host.set({"crank_angle": motion(0, 5 * H)})
    give(host, "crank_angle", [3.0])
    waiting = host.state()
    host.restore(state)
    host.restore(waiting)
    assert host.step(5 * H, H) == OK
    assert host.get("crank.phi", "crank.omega") == pytest.approx([motion(0, 5 * H) + 3.0 * H, 3.0])


def test_step_past_a_limit_is_discard_and_a_smaller_one_follows_the_same_derivatives(
    start: Callable[..., Host],
) -> None:
    host = start("double_pendulum")
    for k in range(4):
        host.set({"crank_angle": 6.0 + 0.05 * k})
        assert host.step(0.1 * k, 0.1) == OK
    host.set({"crank_angle": 6.2})
    give(host, "crank_angle", [1.0])
    assert host.step(0.4, 0.1) == DISCARD
    assert host.get("crank_angle") == [6.2]
    assert host.step(0.4, 0.05) == OK
    assert host.get("crank.phi" if "crank.phi" in host.references else "upper.phi") == pytest.approx([6.25])
    assert host.get("driven.crank_speed") == [1.0]
    host.set({"crank_angle": 9.0})  # out of reach: what is shown is the last good pose, with its own rates
    assert host.status() != 0
    assert host.step(0.45, 0.1) == DISCARD


# Masters


def test_estimated_rates_at_the_end_of_extrapolated_steps_are_of_order_2(built_native: Build, tmp_path: Path) -> None:
    """With `rates` = estimated the slope that a master gives moves the input, and the rates follow the samples."""

    def largest(h: float) -> tuple[float, float]:
        host = Host(built_native("fourbar", 2, "inputs"), tmp_path / "slave")
        host.set({"rates": Rates.ESTIMATED})
        host.initialize(0.0)
        speed = acceleration = 0.0
        for k in range(round(0.6 / h)):
            t = k * h
            host.set({"crank_angle": motion(0, t)})
            give(host, "crank_angle", [(motion(0, t) - motion(0, t - h)) / h])
            assert host.step(t, h) == OK
            if k >= 3:
                omega, alpha, *bounds = host.get("crank.omega", "crank.alpha", "solver.error_qd", "solver.error_qdd")
                speed = max(speed, abs(omega - motion(1, t + h)))
                acceleration = max(acceleration, abs(alpha - motion(2, t + h)))
                assert abs(omega - motion(1, t + h)) <= 1.5 * bounds[0]
                assert abs(alpha - motion(2, t + h)) <= 1.5 * bounds[1]
        host.free()
        return speed, acceleration

    (speed, acceleration), fine = largest(H), largest(H / 4)
    assert math.log(speed / fine[0], 4.0) == pytest.approx(2.0, abs=0.1)
    assert math.log(acceleration / fine[1], 4.0) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("with_states", [False, True])
@pytest.mark.parametrize("has_derivatives", [False, True])
def test_master_that_takes_steps_back_and_halves_them_ends_as_one_that_does_not(
    start: Callable[..., Host], has_derivatives: bool, with_states: bool
) -> None:
    straight, back = start(), start()

    def go(host: Host, t: float, h: float) -> None:
        host.set({"crank_angle": motion(0, t)})
        if has_derivatives:
            give(host, "crank_angle", [motion(1, t), motion(2, t)])
        assert host.step(t, h) == OK

    for k in range(8):
        t = H * k
        go(straight, t, H / 2)
        go(straight, t + H / 2, H / 2)
        state = back.state() if with_states else None
        go(back, t, H)  # refused by another model, say
        if state is not None:
            back.restore(state)
            back.free_state(state)
        go(back, t, H / 2)
        go(back, t + H / 2, H / 2)
        assert back.outputs() == pytest.approx(straight.outputs(), rel=1e-9, abs=1e-12)


def test_fmpy_with_input_derivatives(built_native: Build) -> None:
    """fmpy's own loop; its table of derivatives has nine places, so it works for three drivers alone."""
    from fmpy import simulate_fmu

    h, drivers = 0.01, ("boom_cylinder", "stick_cylinder", "bucket_cylinder")
    starts = {"boom_cylinder": 2.25, "stick_cylinder": 2.45, "bucket_cylinder": 1.85}
    t = h * np.arange(41)
    table = np.zeros(41, [("time", float)] + [(f"{d}_{q}", float) for d in drivers for q in QUANTITIES])
    table["time"] = t
    for k, driver in enumerate(drivers):
        table[f"{driver}_length"] = starts[driver] + 0.05 * np.sin((2 + k) * t)
    names = [f"driven.{driver}_{quantity}" for driver in drivers for quantity in QUANTITIES]
    options = {"fmi_type": "CoSimulation", "stop_time": 0.4, "output_interval": h, "set_input_derivatives": True}
    rows = simulate_fmu(str(built_native("excavator", 2, "inputs")), input=table, output=names, **options)
    for k, driver in enumerate(drivers):
        w, phase = 2 + k, (2 + k) * rows["time"]
        exact = (starts[driver] + 0.05 * np.sin(phase), 0.05 * w * np.cos(phase), -0.05 * w * w * np.sin(phase))
        bounds = (0.05 * w * w * h * h, 1.5 * 0.05 * w * w * h, 2 * 0.05 * w**3 * h)  # the slopes of the step before
        for quantity, value, bound in zip(QUANTITIES, exact, bounds, strict=True):
            assert np.abs(rows[f"driven.{driver}_{quantity}"] - value)[4:].max() < 1.1 * bound
