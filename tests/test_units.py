"""Units: conversion, and advice where a number is in another one."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse
from kinfmu.units import (
    METRES,
    CoordinateName,
    InputName,
    Quantity,
    display_units,
    every_unit,
    factors,
    in_turns,
    looks_like_degrees,
    quantity_in,
    read_coordinate,
    read_inputs,
    unit_of,
)
from tests.mechanism.test_wrong_files import CRANK_ROCKER

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
    ("axis", "names"),
    [("x", ["a.x", "a.vx", "a.ax"]), ("y", ["a.y", "a.vy", "a.ay"]), ("phi", ["a.phi", "a.omega", "a.alpha"])],
)
def test_rates_and_accelerations_have_names_of_their_own(axis: str, names: list[str]) -> None:
    assert [CoordinateName("a", axis).derivative(order) for order in range(3)] == names


def test_a_coordinate_is_made_of_its_owner_and_its_axis() -> None:
    angle, length = CoordinateName("crank", "phi"), CoordinateName("phi", "x")
    assert (angle, length) == ("crank.phi", "phi.x")
    assert (angle.is_angle, length.is_angle) == (True, False)
    assert (angle.quantity(1), length.quantity()) == (Quantity("angle", 1), Quantity("length"))
    assert str(angle) == f"{angle}" == "crank.phi"
    assert repr((angle,)) == "('crank.phi',)"


def test_an_input_is_made_of_its_driver_and_its_noun() -> None:
    value = InputName("crank", "angle")
    assert [value.derivative(order) for order in range(3)] == ["crank_angle", "crank_speed", "crank_acceleration"]
    assert [value.derivative(order).quantity for order in range(3)] == [Quantity("angle", order) for order in range(3)]
    assert InputName("ram", "length", 1).quantity == Quantity("length", 1)


@pytest.mark.parametrize("name", [CoordinateName("crank", "phi"), InputName("ram", "length", 2)])
def test_a_copied_name_keeps_its_facts(name: CoordinateName | InputName) -> None:
    for copied in (copy.copy(name), copy.deepcopy(name)):
        assert type(copied) is type(name)
        assert copied == name
        assert copied.derivative(1) == name.derivative(1)


def test_names_in_files_become_values() -> None:
    coordinate = read_coordinate("coupler.x")
    assert coordinate is not None
    assert (coordinate.owner, coordinate.axis) == ("coupler", "x")
    assert [read_coordinate(text) for text in ("x", ".x", "coupler.z", "coupler.vx")] == [None] * 4
    inputs = read_inputs(["big_ram_length", "big_ram_speed", "big_ram_acceleration"])
    assert inputs is not None
    assert {name.driver for name in inputs} == {"big_ram"}
    assert read_inputs([]) == ()


@pytest.mark.parametrize(
    "texts",
    [["crank_angle"], ["crank_angle", "crank_speed", "rod_acceleration"], ["_angle", "_speed", "_acceleration"]],
)
def test_texts_that_are_no_inputs_are_recognized(texts: list[str]) -> None:
    assert read_inputs(texts) is None


# ---------------------------------------------------------------------------------------------------------- unit advice


MECHANISM = parse(CRANK_ROCKER.replace("crank = 1.0", "size = 1.25", 1).replace('"crank", 0', '"0.8*size", 0', 1))
MEASURE = {"swing": {"type": "range", "of": "rocker.phi"}}


@pytest.mark.parametrize(
    "call",
    [
        lambda: kinfmu.study(MECHANISM, {"size": {"from": "25 mm", "to": "35 mm"}}, measures=MEASURE),
        lambda: kinfmu.study(MECHANISM, {"size": {"tolerance": "25 mm"}}, measures=MEASURE),
    ],
    ids=["range", "tolerance"],
)
def test_the_message_states_the_cure(call: Callable[[], Any]) -> None:
    with pytest.raises(KinfmuError) as caught:
        call()
    assert "'25 mm': unit 'mm' does not belong to a pure number; size has no unit in the mechanism file" in str(
        caught.value
    )
    assert str(caught.value).endswith('write there size = "1.25 m"')


def test_a_fit_states_the_cure_too(tmp_path: Any) -> None:
    from kinfmu.mechanism.toml_text import text

    swing = '[measures.swing]\ntype = "range"\nof = "rocker.phi"\n'
    (tmp_path / "mine.toml").write_text(f"{text(MECHANISM)}\n{swing}", encoding="utf-8")
    (tmp_path / "fit.toml").write_text(
        'mechanism = "mine.toml"\n[unknowns]\nsize = ["1000 mm", "1500 mm"]\n[targets.swing]\ntype = "measure"\n'
        'of = "swing"\nvalue = 1.0\n',
        encoding="utf-8",
    )
    with pytest.raises(KinfmuError, match=r'size = "1\.25 m"$'):
        kinfmu.fit(tmp_path / "fit.toml")
