"""Samples that lie much closer together than the others do not change what is measured."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import kinfmu
from kinfmu.mechanism.measures import Maximum, PeakAcceleration, PeakSpeed, Reading
from kinfmu.motion.samples import is_crowded, spread

READINGS: list[Reading] = [
    PeakSpeed("v", "piston.x"),
    PeakAcceleration("a", "piston.x"),
    Maximum("vx", "piston.vx"),
    Maximum("ax", "piston.ax"),
]
TURN = np.linspace(0.0, 2.0 * math.pi, 361)


def closed_form() -> list[float]:
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
    assert values(np.union1d(TURN, close)) == pytest.approx(closed_form(), rel=1e-9)


@pytest.mark.parametrize("angles", [np.union1d(TURN, np.linspace(1.5, 1.51, 1001)), np.union1d(TURN, TURN + 1e-14)])
def test_many_close_samples_change_nothing(angles: np.ndarray) -> None:
    assert values(angles[angles <= TURN[-1]]) == pytest.approx(closed_form(), rel=1e-9)


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
