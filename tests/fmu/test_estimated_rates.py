"""Speed and acceleration estimated from the angle: the order of the error in the step."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu.fmu.slave.estimated_rates import errors_of_estimated_rates, estimated_rates
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from tests.fmu.host import OK, Host


def _errors(host: Host, h: float) -> tuple[float, float]:
    """Largest error of coupler.vx and coupler.ax over 1 s of u = 1 + 0.3 sin 2 t, the first samples aside."""
    speed = acceleration = 0.0
    for k in range(round(1.0 / h) + 1):
        t = k * h
        u, ud, udd = 1 + 0.3 * math.sin(2 * t), 0.6 * math.cos(2 * t), -1.2 * math.sin(2 * t)
        host.set({"crank_angle": u})
        vx, ax = host.get("coupler.vx", "coupler.ax")
        if k > 2:
            speed = max(speed, abs(vx + math.sin(u) * ud))
            acceleration = max(acceleration, abs(ax + math.sin(u) * udd + math.cos(u) * ud * ud))
        assert host.step(t, h) == OK
    return speed, acceleration


def test_error_of_speed_falls_as_h_squared_and_of_acceleration_as_h(start: Callable[..., Host]) -> None:
    coarse = _errors(start(), 0.01)
    fine = _errors(start(), 0.005)
    assert 3.5 < coarse[0] / fine[0] < 4.5
    assert 1.7 < coarse[1] / fine[1] < 2.3


def test_rate_counts_as_wired_from_its_first_value_other_than_zero(start: Callable[..., Host]) -> None:
    host = start()
    for k in range(4):
        host.set({"crank_angle": 1.0 + 0.1 * k, "crank_speed": 0.0})
        host.step(0.1 * k, 0.1)
    host.set({"crank_angle": 1.4, "crank_speed": 0.0})
    assert host.get("crank.omega") == pytest.approx([1.0])
    host.set({"crank_speed": 3.0})
    assert host.get("crank.omega", "driven.crank_speed") == [3.0, 3.0]
    host.set({"crank_speed": 0.0})
    assert host.get("crank.omega") == [0.0]
    host.fmu.reset()
    host.initialize(0.0)
    host.set({"crank_angle": 1.0, "crank_speed": 0.0})
    host.step(0.0, 0.1)
    host.set({"crank_angle": 1.1})
    assert host.get("crank.omega") == pytest.approx([1.0])


def test_held_angle_comes_to_rest_and_reading_after_a_step_shows_the_committed_sample(
    start: Callable[..., Host],
) -> None:
    host = start()
    for k in range(4):
        host.set({"crank_angle": 1.0 + 0.1 * k})
        host.step(0.1 * k, 0.1)
    assert host.get("crank.omega") == pytest.approx([1.0])
    for k in range(4, 7):
        host.step(0.1 * k, 0.1)
    assert host.get("crank.omega", "crank.alpha") == [0.0, 0.0]


@pytest.mark.parametrize("again", [0.4, math.nextafter(0.4, 0.0), math.nextafter(0.4, 1.0)])
def test_point_that_is_stepped_again_replaces_its_sample(start: Callable[..., Host], again: float) -> None:
    host = start()
    for k, t in enumerate((0.0, 0.1, 0.2, 0.3, 0.4)):
        host.set({"crank_angle": 0.5 + 0.1 * k})
        assert host.step(t, 0.1) == OK
    host.set({"crank_angle": 0.9001})
    assert host.step(again, 0.1) == OK
    assert host.get("crank.omega") == pytest.approx([1.0], abs=2e-3)
    assert host.get("crank.alpha") == pytest.approx([0.0], abs=0.02)


times = st.floats(0.01, 2.0)
coefficients = st.floats(-5.0, 5.0)


@given(times, times, coefficients, coefficients, coefficients)
def test_estimates_of_a_parabola_are_exact_on_any_grid(h1: float, h2: float, a: float, b: float, c: float) -> None:
    t = (0.0, h1, h1 + h2)
    u = [a + b * x + c * x * x for x in t]
    (speed,), (acceleration,) = estimated_rates([(t[0], (u[0],)), (t[1], (u[1],))], t[2], (u[2],))
    assert speed == pytest.approx(b + 2 * c * t[2], abs=1e-9)
    assert acceleration == pytest.approx(2 * c, abs=1e-7)


def test_one_sample_gives_rest_two_give_a_slope_and_later_samples_do_not_count() -> None:
    assert estimated_rates([], 1.0, (3.0,)) == ((0.0,), (0.0,))
    assert estimated_rates([(0.5, (2.0,))], 1.0, (3.0,)) == ((2.0,), (0.0,))
    assert estimated_rates([(0.5, (2.0,)), (1.0, (9.0,))], 1.0, (3.0,)) == ((2.0,), (0.0,))


def test_an_acceleration_beyond_the_largest_rate_is_0_at_the_last_sample_too() -> None:
    samples = [(k * 1e-3, (0.0 if k < 3 else 1.2e94,)) for k in range(4)]
    (speed,), (acceleration,) = estimated_rates(samples, *samples[-1])
    assert speed == pytest.approx(1.8e97)
    assert acceleration == 0.0  # 1.2e100


def _errors_and_estimates(host: Host, h: float, *, wired: tuple[str, ...] = ()) -> list[list[float]]:
    """True and estimated errors of qd and qdd at each sample of u = 1 + 0.3 sin 2 t, read before and after a step."""
    rows = []
    for k in range(40):
        t = k * h
        u, ud, udd = 1 + 0.3 * math.sin(2 * t), 0.6 * math.cos(2 * t), -1.2 * math.sin(2 * t)
        host.set({"crank_angle": u, **{name: {"crank_speed": ud, "crank_acceleration": udd}[name] for name in wired}})
        exact = [ud, -math.sin(u) * ud / 2, udd, -(math.sin(u) * udd + math.cos(u) * ud * ud) / 2]  # the size is 2
        for is_committed in (False, True):
            if is_committed:
                assert host.step(t, h) == OK
            omega, vx, alpha, ax = host.get("rocker.omega", "coupler.vx", "rocker.alpha", "coupler.ax")
            off = [abs(a - b) for a, b in zip((omega, vx / 2, alpha, ax / 2), exact, strict=True)]
            rows.append([max(off[:2]), max(off[2:]), *host.get("solver.error_qd", "solver.error_qdd")])
    return rows


def test_error_estimates_bound_the_errors_of_estimated_rates(start: Callable[..., Host]) -> None:
    rows = _errors_and_estimates(start(), 0.01)
    assert [row[2] for row in rows[:4]] == [UNKNOWN_ERROR] * 4  # two samples, before and after their steps
    assert [row[3] for row in rows[:6]] == [UNKNOWN_ERROR] * 6
    assert all(row[2] < 1.0 for row in rows[4:])
    assert all(row[3] < 1.0 for row in rows[6:])
    pairs = [pair for row in rows for pair in zip(row[:2], row[2:], strict=True) if pair[1] < UNKNOWN_ERROR]
    assert sum(error <= estimate for error, estimate in pairs) >= 0.99 * len(pairs)
    assert sorted(estimate / error for error, estimate in pairs)[len(pairs) // 2] < 10.0


def test_wired_rates_have_no_error_and_do_not_change_those_of_other_rates(start: Callable[..., Host]) -> None:
    exact = _errors_and_estimates(start(), 0.01, wired=("crank_speed", "crank_acceleration"))
    assert all(max(row) < 1e-12 for row in exact[2:])  # an acceleration of 0 does not count as wired
    with_speed = _errors_and_estimates(start(), 0.01, wired=("crank_speed",))
    assert all(row[2] < 1e-12 for row in with_speed)
    assert all(1e-4 < row[3] < 1.0 for row in with_speed[6:])


def test_errors_of_estimated_rates_are_the_next_term() -> None:
    samples = [(t, (t**3,)) for t in (0.0, 1.0, 3.0, 4.0)]
    before = samples[:3]
    (speed,), (acceleration,) = estimated_rates(before, *samples[3])
    (speed_error,), (acceleration_error,) = errors_of_estimated_rates(before, *samples[3])
    assert speed_error == pytest.approx(2.0 * abs(speed - 48.0))  # twice the error of a cubic
    assert acceleration_error == pytest.approx(2.0 * abs(acceleration - 24.0))
    assert errors_of_estimated_rates(samples[1:3], *samples[3])[1] == (math.inf,)
    assert errors_of_estimated_rates(samples[2:3], *samples[3]) == ((math.inf,), (math.inf,))
