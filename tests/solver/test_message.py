"""Messages say driver values with the digits that a reader needs, in Python and in C."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kinfmu
from kinfmu.backends.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver.message import LOCATED, place

DEAD_CENTRE = math.acos(1.0 / 13.0)  # 65^2 + 100^2 - 2 65 100 cos u = (50 + 65)^2


@pytest.mark.parametrize(
    ("value", "digits", "said"),
    [
        (math.pi / 3.0, 6, "crank = 1.047198 rad (60 deg)"),
        (math.pi / 3.0, LOCATED, "crank = 1.0471975512 rad (60 deg)"),
        (-math.radians(12.25), 6, "crank = -0.213803 rad (-12.25 deg)"),
        (2e-16, LOCATED, "crank = 0 rad (0 deg)"),
        (-2e-16, LOCATED, "crank = 0 rad (0 deg)"),
        (100.0, 6, "crank = 100 rad (5729.578 deg)"),
        (1e300, 6, "crank = 1e+300 rad (5.73e+301 deg)"),
        (math.inf, 6, "crank = inf rad (inf deg)"),
    ],
)
def test_an_angle_has_as_many_decimals_as_it_is_known_to(value: float, digits: int, said: str) -> None:
    model = load_model(compile_plan(kinfmu.load("fourbar")))
    assert place(model, (value,), digits) == said


def test_lengths_have_digits_and_drivers_are_told_one_after_another() -> None:
    model = load_model(compile_plan(kinfmu.load("parallel_jaw")))
    assert place(model, (12.3456789012,)) == "piston = 12.3457 mm"
    assert place(model, (12.3456789012,), LOCATED) == "piston = 12.3456789 mm"
    model = load_model(compile_plan(kinfmu.load("five_bar")))
    assert place(model, (0.5, 1.25)) == "left = 0.5 rad (28.6479 deg), right = 1.25 rad (71.6197 deg)"


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(
    ("beyond", "asked"),
    [
        (1e-3, "left = 1.494797 rad (85.6456 deg)"),
        (1e-8, "left = 1.4937971961 rad (85.58827479 deg)"),  # to six decimals it is the limit
    ],
)
def test_what_cannot_be_reached_is_told_apart_from_the_limit(engine: str, beyond: float, asked: str) -> None:
    u = np.array([1.0, DEAD_CENTRE + beyond])
    (event,) = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=u, engine=engine).events
    limit = "left = 1.4937971861 rad (85.58827421 deg)"
    why = "coupler.phi, right.phi would part"
    assert event.text == f"{asked} cannot be reached: the limit is {limit}, where {why}"
