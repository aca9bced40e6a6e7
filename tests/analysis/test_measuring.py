"""The measures of a file in the report of check: over one cycle of the driver, or over the run of the file."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import kinfmu
from kinfmu.mechanism.toml_file import parse
from kinfmu.readings import Maximum, Minimum, PeakSpeed, Range, TimeRatio


def test_a_driver_that_turns_round_is_measured_over_one_turn_at_its_speed() -> None:
    mechanism = replace(
        kinfmu.load("slider_crank"), measures=(Range("stroke", "piston.x"), PeakSpeed("speed", "crank.P"))
    )
    report = kinfmu.check(mechanism)
    assert report.measured is not None
    stroke, speed = report.measured.values
    assert stroke.value == pytest.approx(90.0, rel=1e-12)
    assert speed.value == pytest.approx(45.0 * 20.0 * math.pi, rel=1e-12)
    assert speed.unit == "mm/s"
    text = str(report)
    assert "  measures    over one turn of crank at 62.8319 rad/s\n" in text
    assert "              stroke = 90 mm (crank at 180 deg and 0 deg)\n" in text
    found = report.as_json()["measures"]
    assert found["over"] == "one turn of crank at 62.8319 rad/s"
    assert found["values"][0]["name"] == "stroke"
    assert found["values"][0]["at"] == pytest.approx([math.pi, 0.0], abs=1e-12)
    assert found["refused"] == {}


def test_a_follower_that_rises_every_second_turn_is_measured_over_two_turns() -> None:
    text = """
name = "tappet"
gravity = { x = 0, y = -9.81 }
[bodies]
ground.points = { O = [0, 0] }
cam.points = { O = [0, 0] }
stem = { points = { F = [0, 0] }, mass = 1 }
[joints]
O = { type = "revolute", between = ["ground.O", "cam.O"] }
guide = { type = "translational", between = ["ground.O", "stem.F"], axis = "90 deg" }
[joints.lift]
type = "cam_translating"
between = ["ground.O", "stem.F"]
cam = "cam"
axis = "90 deg"
offset = 0.032
law = "harmonic"
amplitude = 0.005
frequency = 0.5
[drivers]
cam = { type = "angle", of = "cam", law = "constant_speed", speed = 1 }
[measures]
stroke = { type = "range", of = "stem.y" }
"""
    report = kinfmu.check(parse(text))
    assert report.measured is not None
    assert report.measured.over == "2 turns of cam at 1 rad/s"
    assert report.measured.values[0].value == pytest.approx(0.01, rel=1e-12)
    assert report.loading is not None
    assert report.loading.over == "2 turns of cam at 1 rad/s"


def test_another_motion_is_the_run_of_the_file_and_refusals_have_a_reason() -> None:
    mechanism = replace(
        kinfmu.load("triple_rocker"), measures=(Maximum("high", "left.phi"), TimeRatio("ratio", "right.phi"))
    )
    report = kinfmu.check(mechanism)
    assert report.measured is not None
    assert report.measured.values[0].value == pytest.approx(math.radians(65.0 + 17.0), rel=1e-9)
    assert "over the run of the file, t = 0 to 2 s" in str(report)


def test_coordinates_outside_the_outputs_are_measured_too() -> None:
    mechanism = replace(kinfmu.load("slider_crank"), coordinates=("crank.phi",), measures=(Minimum("low", "piston.x"),))
    report = kinfmu.check(mechanism)
    assert report.measured is not None
    assert report.measured.values[0].value == pytest.approx(99.0, rel=1e-12)


def test_a_measure_that_does_not_fit_the_motion_is_refused_with_the_reason() -> None:
    mechanism = kinfmu.load("triple_rocker")
    part = replace(mechanism, run=replace(mechanism.run, stop=0.7), measures=(TimeRatio("ratio", "right.phi"),))
    report = kinfmu.check(part)
    assert report.measured is not None
    assert list(report.measured.refused) == ["ratio"]
    assert "ratio: no value, because time_ratio needs a motion that goes round" in str(report)


def test_a_mechanism_without_measures_has_no_such_section() -> None:
    report = kinfmu.check(kinfmu.load("slider_crank"))
    assert report.measured is None
    assert report.as_json()["measures"] is None
    assert "measures" not in str(report)
