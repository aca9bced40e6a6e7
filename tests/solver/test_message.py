"""Messages say driver values with the digits that a reader needs, in Python and in C."""

from __future__ import annotations

import ctypes
import math
import re

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver.python.limit import LOCATED, NO_POLE, Limit, limit_message, place
from tests.solver.c.native import Native

DEAD_CENTRE = math.acos(1.0 / 13.0)  # 65^2 + 100^2 - 2 65 100 cos u = (50 + 65)^2


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (math.pi / 3.0, 6, "crank = 1.047198 rad (60 deg)"),
        (math.pi / 3.0, LOCATED, "crank = 1.0471975512 rad (60 deg)"),
        (-math.radians(12.25), 6, "crank = -0.213803 rad (-12.25 deg)"),
        (2e-16, LOCATED, "crank = 0 rad (0 deg)"),
        (-2e-16, LOCATED, "crank = 0 rad (0 deg)"),
        (100.0, 6, "crank = 100 rad (5729.578 deg)"),
        (1e300, 6, "crank = 1e+300 rad (5.73e+301 deg)"),
        (2e6 + 1e-8, LOCATED, "crank = 2000000.00000001 rad (114591559.02617 deg)"),
        (math.inf, 6, "crank = inf rad (inf deg)"),
    ],
)
@pytest.mark.few(3)
def test_an_angle_has_as_many_decimals_as_it_is_known_to(value: float, digits: int, text: str) -> None:
    model = load_model(compile_plan(kinfmu.load("fourbar")))
    assert place(model, (value,), digits) == text


def test_lengths_have_digits_and_drivers_are_listed_in_order() -> None:
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
def test_a_value_out_of_reach_is_shown_with_digits_that_differ_from_the_limit(
    engine: str, beyond: float, asked: str
) -> None:
    u = np.array([1.0, DEAD_CENTRE + beyond])
    (event,) = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=u, engine=engine).events
    limit = "left = 1.4937971861 rad (85.58827421 deg)"
    why = "beyond it the loop of coupler.phi, right.phi cannot close"
    assert event.text == f"{asked} cannot be reached: the limit is {limit}; {why}"


class NativeLimit(ctypes.Structure):
    """kf_limit of a mechanism with one driver."""

    _fields_ = (
        ("u", ctypes.c_double * 1),
        ("block", ctypes.c_int),
        ("crosses", ctypes.c_bool),
        ("pole", ctypes.c_int),
    )


@pytest.fixture(scope="module")
def native() -> Native:
    return Native(compile_plan(kinfmu.load("triple_rocker")))


def native_message(native: Native, limit: float, asked: float) -> str:
    text = ctypes.create_string_buffer(480)
    found = NativeLimit((ctypes.c_double * 1)(limit), 0, False, NO_POLE)
    native.c.probe_limit(text, ctypes.byref(found), (ctypes.c_double * 1)(asked))
    return text.value.decode()


@pytest.mark.parametrize("turns", [0, 5, 1_000_000])
@pytest.mark.parametrize("beyond", [3e-9, 1e-10, 3e-11, 1e-12, 0.0])
@pytest.mark.few(5)
def test_a_refused_value_never_has_the_digits_of_its_limit(native: Native, turns: int, beyond: float) -> None:
    model = load_model(compile_plan(kinfmu.load("triple_rocker")))
    limit = DEAD_CENTRE + turns * math.tau
    text = limit_message(model, Limit((limit,), 0), (limit + beyond,))
    assert text == native_message(native, limit, limit + beyond)
    numbers = re.findall(r"(\S+) rad \((\S+) deg\)", text)
    assert all(len(set(column)) == len(column) for column in zip(*numbers, strict=True)), text
    assert len(numbers) == 2 or "cannot be reached: to these digits it is the limit; beyond it" in text
