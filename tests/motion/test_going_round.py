"""Motions that go round, repeat, or have samples close together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import kinfmu
from kinfmu.mechanism.measures import Maximum, PeakAcceleration, PeakSpeed, Reading, TimeRatio
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion import History, quintic
from kinfmu.motion.quintic import ranges, use_compiled
from kinfmu.motion.samples import goes_round, is_crowded, spread
from tests.reports import unwrapped

X = np.linspace(0.0, 2.0 * np.pi, 38)


@pytest.fixture(params=["compiled", "numpy"])
def arithmetic(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    use_compiled()
    monkeypatch.setattr(quintic, "_compiled", quintic._compiled if request.param == "compiled" else [])


def sine(frequency: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    f = frequency
    return np.sin(f * X), f * np.cos(f * X), -f * f * np.sin(f * X)


def history_of(rows: tuple[np.ndarray, np.ndarray, np.ndarray]) -> History:
    return History(X, *(np.array(row) for row in rows))


@pytest.mark.usefixtures("arithmetic")
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("place", [0, 5, 36, 37])
@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("is_angle", [True, False])
def test_a_design_with_an_unknown_sample_does_not_go_round(
    order: int, place: int, unknown: float, is_angle: bool
) -> None:
    rows = tuple(np.array([row, row, 2.0 * row]) for row in sine(1.0))
    rows[order][1, place] = unknown
    other = history_of(tuple(np.array([row, row, row]) for row in sine(2.0)))  # type: ignore[arg-type]
    assert goes_round([(history_of(rows), is_angle), (other, False)]).tolist() == [True, False, True]  # type: ignore[arg-type]


@pytest.mark.usefixtures("arithmetic")
def test_the_last_sample_is_compared_with_the_first_one_of_each_quantity() -> None:
    turning = (X, np.ones_like(X), np.zeros_like(X))
    still = (np.ones_like(X), np.zeros_like(X), np.zeros_like(X))
    assert goes_round([(history_of(turning), True)])
    assert not goes_round([(history_of(turning), False)])
    assert not goes_round([(history_of(still), False)])
    assert goes_round([(history_of(still), False), (history_of(sine(3.0)), False)])
    assert not goes_round([(history_of(sine(1.0)), False), (history_of(sine(0.5)), False)])
    value, rate, acceleration = sine(1.0)
    for off, goes in ((1e-10, True), (1e-8, False)):
        assert goes_round([(history_of((value + off * X, rate, acceleration)), False)]) == goes


@pytest.mark.usefixtures("arithmetic")
def test_of_designs_without_gaps_a_few_samples_decide_unless_they_are_too_small() -> None:
    """A motion that the few samples miss is measured by all of them."""
    large, _, _ = sine(1.0)
    bump = np.zeros_like(X)
    bump[3] = 1.0
    off = 1e-10 * X
    values = np.array([large + off, bump + off, large + 10.0 * X, off * 0.0, large])
    values[4, 5] = np.nan
    history, is_known = history_of((values, 0.0 * values, 0.0 * values)), np.array([True, True, True, True, False])
    expected = [True, True, False, False, False]
    assert goes_round([(history, False)]).tolist() == expected
    assert goes_round([(history, False)], is_known).tolist() == expected
    assert goes_round([(History(X, *(row[:1] for row in history.rows)), False)], is_known[:1]).tolist() == [True]


@pytest.mark.usefixtures("arithmetic")
@pytest.mark.parametrize("count", [1, 7, 8, 9, 361])
def test_ranges_are_the_smallest_and_the_largest_number_of_each_row(count: int) -> None:
    table = np.random.default_rng(count).normal(size=(5, 2, count + 3))[:, :, :count]
    low, high = ranges(table)
    np.testing.assert_array_equal(low, table.min(axis=-1))
    np.testing.assert_array_equal(high, table.max(axis=-1))


# -------------------------------------------------------------------------------------------------------------- repeats


RATIO = TimeRatio("ratio", "rocker.phi")
CRANK, ROCKER, BASE = 20.0, 50.0, 40.0
TEXT = f"""
name = "hoeken"
units.length = "mm"
bodies.ground.points = {{ O = [0, 0], C = [{BASE}, 0], W = [-100, 0] }}
bodies.crank.points = {{ O = [0, 0], P = [{CRANK}, 0] }}
bodies.coupler = {{ points = {{ P = [0, 0], Q = [{ROCKER}, 0] }}, start = {{ x = 20, phi = "78 deg" }} }}
bodies.rocker = {{ points = {{ C = [0, 0], Q = [{ROCKER}, 0] }}, start = {{ x = 40, phi = "102 deg" }} }}
joints.O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
joints.P = {{ type = "revolute", between = ["crank.P", "coupler.P"] }}
joints.Q = {{ type = "revolute", between = ["coupler.Q", "rocker.Q"] }}
joints.C = {{ type = "revolute", between = ["ground.C", "rocker.C"] }}
drivers.crank = {{ type = "angle", of = "crank", law = "constant_speed", speed = "30 rpm" }}
"""


def closed_form() -> float:
    """Return the time ratio: the rocker turns back where crank and coupler are in line, stretched or folded."""
    stretched, folded = ROCKER + CRANK, ROCKER - CRANK
    angles = [math.acos((BASE**2 + far**2 - ROCKER**2) / (2.0 * BASE * far)) for far in (stretched, folded)]
    stroke = math.pi + angles[1] - angles[0]
    return max(stroke, math.tau - stroke) / min(stroke, math.tau - stroke)


@pytest.mark.parametrize("turns", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("start", [0.0, 0.3, 1.1])
def test_time_ratio_over_several_turns(turns: int, start: float) -> None:
    run = kinfmu.solve(parse(TEXT), crank_angle=start + np.linspace(0.0, math.tau * turns, 360 * turns + 1))
    found = kinfmu.measure(run, [RATIO])["ratio"]
    assert found.value == pytest.approx(closed_form(), rel=1e-9)
    assert all(start <= at <= start + math.tau for at in found.at)


def test_designs_over_several_turns() -> None:
    model = kinfmu.compile(parse('parameters.base = "40 mm"' + TEXT.replace(f"C = [{BASE}", 'C = ["base"')))
    angles = np.linspace(0.3, 0.3 + 2.0 * math.tau, 721)
    found = kinfmu.measure_designs(model, {"base": [BASE, 41.0, 39.0]}, [RATIO], crank_angle=angles)
    assert found["ratio"][0] == pytest.approx(closed_form(), rel=1e-9)
    single = [kinfmu.measure(model.solve(parameters={"base": b}, crank_angle=angles), [RATIO]) for b in (41.0, 39.0)]
    assert found["ratio"][1:].tolist() == [one["ratio"].value for one in single]


def test_check_over_two_turns() -> None:
    text = (
        TEXT + "bodies.wheel = { points = { W = [0, 0] }, start = { x = -100, y = 0 } }\n"
        'joints.W = { type = "revolute", between = ["ground.W", "wheel.W"] }\n'
        'joints.gear = { type = "gear", between = ["crank", "wheel"], ratio = -0.5 }\n'
        'measures.ratio = { type = "time_ratio", of = "rocker.phi" }\n'
    )
    report = unwrapped(kinfmu.check(parse(text)))
    assert "Over 2 turns of crank" in report
    assert f"ratio {closed_form():.9g} " in report


@pytest.mark.parametrize("count", [1, 2, 3, 5, 12])
def test_repeats_of_a_curve_with_two_peaks(count: int) -> None:
    x = np.linspace(0.0, math.tau, 721)
    a = count * x
    rows = [
        np.sin(a) + 0.8 * np.sin(2.0 * a),
        count * (np.cos(a) + 1.6 * np.cos(2.0 * a)),
        -(count**2) * (np.sin(a) + 3.2 * np.sin(2.0 * a)),
    ]
    curve = History(x, rows[0], rows[1], rows[2], is_closed=True)
    assert curve.repeats() == count
    other = [1e-3 * np.sin(x), 1e-3 * np.cos(x), -1e-3 * np.sin(x)]
    sums = [row + more for row, more in zip(rows, other, strict=True)]
    assert History(x, sums[0], sums[1], sums[2], is_closed=True).repeats() == 1


# ------------------------------------------------------------------------------------------------------------- crowding


READINGS: list[Reading] = [
    PeakSpeed("v", "piston.x"),
    PeakAcceleration("a", "piston.x"),
    Maximum("vx", "piston.vx"),
    Maximum("ax", "piston.ax"),
]
TURN = np.linspace(0.0, 2.0 * math.pi, 361)


def crowded_closed_form() -> list[float]:
    """Return what READINGS measure, of x = r cos u + sqrt(l^2 - r^2 sin^2 u) at unit speed."""
    r, rod = 45.0, 144.0

    def speed(u: float) -> float:
        return -r * math.sin(u) - r * r * math.sin(u) * math.cos(u) / math.sqrt(rod**2 - (r * math.sin(u)) ** 2)

    def acceleration(u: float) -> float:
        w = math.sqrt(rod**2 - (r * math.sin(u)) ** 2)
        return -r * math.cos(u) - r * r * math.cos(2.0 * u) / w - (r * r * math.sin(u) * math.cos(u)) ** 2 / w**3

    fastest = -minimize_scalar(speed, bounds=(0.5, 2.0), method="bounded", options={"xatol": 1e-12}).fun
    steepest = -minimize_scalar(
        lambda u: -acceleration(u), bounds=(1.7, math.pi - 0.3), method="bounded", options={"xatol": 1e-12}
    ).fun
    return [fastest, -acceleration(0.0), fastest, max(steepest, acceleration(math.pi))]


def values(angles: np.ndarray, engine: str = "python") -> list[float]:
    run = kinfmu.solve(kinfmu.load("slider_crank"), crank_angle=angles, engine=engine)
    return [found.value for found in kinfmu.measure(run, READINGS).values()]


@pytest.mark.parametrize("distance", [2.3e-16, 1e-12, 1e-9, 7.5e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("count", [1, 3])
def test_a_sample_close_to_another_changes_nothing(distance: float, count: int) -> None:
    close = TURN[100] + distance * np.arange(1, count + 1)
    assert values(np.union1d(TURN, close)) == pytest.approx(crowded_closed_form(), rel=1e-9)


@pytest.mark.parametrize("angles", [np.union1d(TURN, np.linspace(1.5, 1.51, 1001)), np.union1d(TURN, TURN + 1e-14)])
def test_many_close_samples_change_nothing(angles: np.ndarray) -> None:
    assert values(angles[angles <= TURN[-1]]) == pytest.approx(crowded_closed_form(), rel=1e-9)


def test_times_that_are_a_union_of_two_grids() -> None:
    m = kinfmu.load("slider_crank")
    times = np.unique(np.concatenate([np.arange(0.0, 1.0001, 0.01), np.linspace(0.0, 1.0, 11)]))
    assert is_crowded(times)
    both = [kinfmu.measure(kinfmu.solve(m, t=t), READINGS) for t in (times, np.linspace(0.0, 1.0, 101))]
    crowded, plain = ([found.value for found in one.values()] for one in both)
    assert crowded == pytest.approx(plain, rel=1e-6)  # other samples at the ends, the same motion


def test_designs_are_measured_as_runs_are() -> None:
    angles = np.union1d(TURN, TURN[100] + 1e-9)
    m = kinfmu.load("fourbar_loaded")
    readings: list[Reading] = [PeakAcceleration("a", "rocker.phi"), Maximum("alpha", "rocker.alpha")]
    model = kinfmu.compile(m)
    found = kinfmu.measure_designs(model, {"rocker_center": [19.0, 20.0]}, readings, crank_angle=angles)
    for k, length in enumerate((19.0, 20.0)):
        run = model.solve(parameters={"rocker_center": length}, crank_angle=angles)
        single = kinfmu.measure(run, readings)
        assert {name: column[k] for name, column in found.values.items()} == {
            name: one.value for name, one in single.items()
        }


def test_ends_and_breaks_and_steep_changes_are_kept() -> None:
    x = np.array([0.0, 1e-6, 1.0, 2.0, 2.0 + 1e-7, 2.0 + 2e-7, 2.0 + 2e-7, 2.0 + 3e-7, 3.0, 4.0 - 1e-9, 4.0])
    flat = np.ones((len(x), 1))
    assert spread(x, flat, flat).tolist() == [0, 2, 5, 6, 8, 10]
    steep = flat * np.arange(len(x))[:, None]
    assert spread(x, flat, steep).tolist() == list(range(len(x)))
    assert not is_crowded(np.array([0.0, 1.0, 1.0, 2.0]))
