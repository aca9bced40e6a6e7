"""Units that files may write, and units that variables declare; names of derivatives."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from kinfmu.units import (
    METRES,
    Quantity,
    derivative_name,
    display_units,
    every_unit,
    factors,
    in_turns,
    looks_like_degrees,
    quantity_in,
    quantity_of,
    unit_of,
)

EXACT = {"m": "1", "mm": "0.001", "cm": "0.01", "um": "0.000001", "km": "1000", "in": "0.0254", "ft": "0.3048"}


def test_multiples_of_15_from_30_look_like_degrees() -> None:
    for angle in (30.0, 45.0, 90.0, -120.0, 360.0, 3600.0):
        assert looks_like_degrees(angle)
    for angle in (0.0, 15.0, 31.0, 4.0 * math.pi, 100.0, 45.5):
        assert not looks_like_degrees(angle)
    assert in_turns(-360.0) == "57.3 turns"


@pytest.mark.parametrize("inside", METRES)
def test_a_length_is_converted_to_the_unit_of_the_file_to_the_last_digit(inside: str) -> None:
    assert METRES.keys() == EXACT.keys()
    for unit, factor in factors(Quantity("length"), inside).items():
        exact = float(Fraction(EXACT[unit]) / Fraction(EXACT[inside]))
        assert factor == pytest.approx(exact, rel=4e-16, abs=0.0)
    assert factors(Quantity("length"), inside)[inside] == 1.0


def test_angles_may_be_written_in_degrees_and_turns() -> None:
    assert factors(Quantity("angle"), "m") == {"rad": 1.0, "deg": math.radians(1.0), "rev": 2.0 * math.pi}


def test_times_may_be_written_in_other_units() -> None:
    assert factors(Quantity("time"), "mm") == {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}


def test_speeds_are_written_per_second_or_per_minute() -> None:
    speeds = factors(Quantity("angle", 1), "m")
    assert list(speeds) == ["rad/s", "rad/min", "deg/s", "deg/min", "rev/s", "rev/min", "rpm", "Hz"]
    assert speeds["rpm"] == speeds["rev/min"] == 2.0 * math.pi / 60.0
    assert speeds["Hz"] == speeds["rev/s"] == 2.0 * math.pi
    assert factors(Quantity("length", 1), "mm")["m/min"] == pytest.approx(1000.0 / 60.0)
    assert "rpm" not in factors(Quantity("length", 1), "m")


def test_accelerations_are_written_per_second_squared_only() -> None:
    assert list(factors(Quantity("angle", 2), "m")) == ["rad/s2", "deg/s2", "rev/s2"]
    assert factors(Quantity("length", 2), "mm")["m/s2"] == 1000.0


def test_derivatives_to_an_angle_or_a_length_and_of_higher_order_have_units_too() -> None:
    lift = factors(Quantity("length", 1, "angle"), "mm")
    assert lift["mm/rad"] == 1.0
    assert lift["m/rev"] == pytest.approx(1000.0 / (2.0 * math.pi))
    assert factors(Quantity("angle", 2, "length"), "m")["deg/mm2"] == pytest.approx(math.radians(1.0) * 1e6)
    assert factors(Quantity("angle", 3), "m")["deg/s3"] == math.radians(1.0)
    assert factors(Quantity("angle", 8), "m") == {}
    every = every_unit("mm")
    assert every["mm/rad"] == (Quantity("length", 1, "angle"), 1.0)
    assert every["rad/s7"] == (Quantity("angle", 7), 1.0)


def test_plain_numbers_take_no_unit() -> None:
    assert factors(Quantity("number"), "m") == {}


@pytest.mark.parametrize(
    ("quantity", "unit"),
    [
        (Quantity("length"), "mm"),
        (Quantity("length", 1), "mm/s"),
        (Quantity("length", 2), "mm/s2"),
        (Quantity("angle"), "rad"),
        (Quantity("angle", 2), "rad/s2"),
        (Quantity("time"), "s"),
        (Quantity("number"), "1"),
        (Quantity("length", 3), "mm/s3"),
        (Quantity("angle", 1, "length"), "rad/mm"),
        (Quantity("number", 2, "angle"), "1/rad2"),
    ],
)
def test_a_variable_declares_the_unit_used_inside(quantity: Quantity, unit: str) -> None:
    assert unit_of(quantity, "mm") == unit
    assert quantity_in(unit, "mm") == (Quantity("number") if quantity.kind == "number" else quantity)


def test_display_units_are_degrees_and_millimetres() -> None:
    assert display_units("rad") == {"deg": 180.0 / math.pi}
    assert display_units("rad/s2") == {"deg/s2": 180.0 / math.pi}
    assert display_units("m/s") == {"mm/s": 1000.0}
    assert display_units("mm") == {}
    assert display_units("1") == {}


@pytest.mark.parametrize(
    ("name", "rate", "acceleration"),
    [("a.x", "a.vx", "a.ax"), ("a.y", "a.vy", "a.ay"), ("a.phi", "a.omega", "a.alpha")],
)
def test_rates_and_accelerations_have_names_of_their_own(name: str, rate: str, acceleration: str) -> None:
    assert [derivative_name(name, order) for order in range(3)] == [name, rate, acceleration]


def test_what_a_coordinate_measures_follows_from_its_name() -> None:
    assert quantity_of("crank.phi", 1) == Quantity("angle", 1)
    assert quantity_of("phi.x") == Quantity("length")
