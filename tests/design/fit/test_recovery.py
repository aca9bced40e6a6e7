"""Fits that find known mechanisms again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.design.fit import FunctionTarget, PathTarget, PoseTarget
from tests.design.fit.fourbars import LENGTHS, closed_form, four_bar
from tests.design.fit.mkh1 import BEST, mkh1

KNOWN = {"ground": 4.1, "crank": 1.1, "coupler": 3.3, "rocker": 3.2, "px": 1.5, "py": 1.35}
BOUNDS = {name: (0.6 * value, 1.5 * value) for name, value in LENGTHS.items()}
ANGLES = np.radians(30.0) * np.arange(12)
X, Y, COUPLER, ROCKER = closed_form(ANGLES, KNOWN)
PATH: dict[str, Any] = {"name": "curve", "of": "coupler.X", "points": np.column_stack([X, Y])}


def _assert_known(result: kinfmu.FitResult, names: Any) -> None:
    for name in names:
        assert result.parameters[name] == pytest.approx(KNOWN[name], abs=1e-8), name
        assert result.mechanism.parameters[name].value == result.parameters[name]
    assert result.squares < 1e-20
    assert result.note == ""


@pytest.mark.parametrize(
    "timing", [{"at": ANGLES.tolist()}, {"step": "30 deg", "start": ("-90 deg", "90 deg")}, {}], ids=str
)
@pytest.mark.few(2)
def test_a_four_bar_from_twelve_points_of_its_coupler_curve(timing: dict[str, Any]) -> None:
    problem = kinfmu.FitProblem(four_bar(), BOUNDS, [PathTarget(**PATH, **timing)])

    result = kinfmu.fit(problem, starts=2, engine="python")

    _assert_known(result, KNOWN)
    assert np.hypot(*result.errors[0].errors.T).max() < 1e-9
    if "start" in timing:
        assert result.parameters["curve.start"] == pytest.approx(0.0, abs=1e-8)


def test_a_four_bar_from_its_function() -> None:
    points = np.column_stack([ANGLES - 0.2, ROCKER - 0.3])
    target = FunctionTarget(name="f", of="rocker.phi", points=points, start=(-1.0, 1.0), offset=("-1 rad", 1))
    bounds = {name: BOUNDS[name] for name in ("crank", "coupler", "rocker")}
    known = {**KNOWN, **{name: KNOWN[name] * 4.0 / 4.1 for name in bounds}}  # a function fixes ratios of lengths

    result = kinfmu.fit(kinfmu.FitProblem(four_bar(), bounds, [target]), starts=2, engine="python")

    for name in bounds:
        assert result.parameters[name] == pytest.approx(known[name], abs=1e-8)
    assert result.parameters["f.start"] == pytest.approx(0.2, abs=1e-8)
    assert result.parameters["f.offset"] == pytest.approx(0.3, abs=1e-8)


def test_a_four_bar_from_a_function_between_two_outputs() -> None:
    over = np.radians([90.0, 105.0, 120.0, 140.0, 160.0, 180.0])
    _, _, coupler, rocker = closed_form(over, KNOWN)
    target = FunctionTarget(
        name="f",
        of="coupler.phi",
        over="rocker.phi",
        points=np.column_stack([rocker, coupler]),
        begin="50 deg",
        end="220 deg",
    )
    bounds = {"crank": (0.9, 1.3), "rocker": (2.9, 3.5)}
    mechanism = four_bar(ground=KNOWN["ground"], coupler=KNOWN["coupler"])

    result = kinfmu.fit(kinfmu.FitProblem(mechanism, bounds, [target]), starts=1, engine="python")

    _assert_known(result, bounds)
    assert result.errors[0].at == pytest.approx(over, abs=1e-7)


@pytest.mark.parametrize("timing", [{"step": "30 deg"}, {}], ids=str)
def test_a_four_bar_from_poses_of_its_coupler(timing: dict[str, Any]) -> None:
    poses = np.column_stack([KNOWN["crank"] * np.cos(ANGLES), KNOWN["crank"] * np.sin(ANGLES), COUPLER + math.tau])
    target = PoseTarget(name="guide", of="coupler", poses=poses, length="2 m", **timing)
    bounds = {name: BOUNDS[name] for name in ("ground", "crank", "coupler", "rocker")}

    result = kinfmu.fit(kinfmu.FitProblem(four_bar(), bounds, [target]), starts=1, engine="python")

    _assert_known(result, bounds)


def test_a_mechanism_from_the_values_of_measures() -> None:
    swing = kinfmu.measures.Range("swing", of="rocker.phi")
    inward, outward = (  # the dead centres, where crank and coupler fall in line
        math.pi - math.acos((3.0**2 + 4.0**2 - (3.5 + side * 1.2) ** 2) / 24.0) for side in (-1.0, 1.0)
    )
    target = kinfmu.design.MeasureTarget(name="swing", of=swing, value=abs(outward - inward))

    result = kinfmu.fit(kinfmu.FitProblem(four_bar(), {"crank": (0.8, 1.4)}, [target]), starts=1, engine="python")

    assert result.parameters["crank"] == pytest.approx(1.2, abs=1e-8)


# ----------------------------------------------------------------------------------------------------------------- mkh1


def test_the_best_optimum_is_found_from_near_it() -> None:
    result = kinfmu.fit(mkh1(within=0.2), starts=1, engine="python")

    assert result.squares == pytest.approx(BEST, abs=1e-11)
    assert result.squares < 0.0091150  # the best published one
