"""Time ratios of motions that hold several repeats of a quantity."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism.measures import TimeRatio
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion.history import History

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
    report = str(kinfmu.check(parse(text)))
    assert "over 2 turns of crank" in report
    assert f"ratio = {closed_form():.9g}" in report


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
