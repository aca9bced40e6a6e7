"""Measures of `check` and their texts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.design.fit import MeasureConstraint, MeasureTarget
from kinfmu.design.study.definition import define
from kinfmu.draw.study import Quantities
from kinfmu.mechanism import toml_text
from kinfmu.mechanism.measures import Maximum, Minimum, PeakSpeed, Range, TimeRatio, counted_from
from kinfmu.mechanism.toml_file import parse
from tests.reports import unwrapped


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
    text = unwrapped(report)
    assert " Over one turn of crank at 600 rpm\n measure value at crank\n" in text
    assert " stroke 90 mm 180 deg and 0 deg\n" in text
    found = report.as_json()["measures"]
    assert found["over"] == "one turn of crank at 600 rpm"
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
    assert "Over the run of the file, t = 0 to 2 s" in unwrapped(report)


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
    assert "ratio: no value, because time_ratio needs a motion that goes round" in unwrapped(report)


def test_a_mechanism_without_measures_has_no_such_section() -> None:
    report = kinfmu.check(kinfmu.load("slider_crank"))
    assert report.measured is None
    assert report.as_json()["measures"] is None
    assert "measure" not in str(report)


SLIDER_CRANK = """
name = "press"
gravity = { x = 0, y = -9.81 }
run = { stop = 2, step = 0.005 }
[bodies]
ground.points = { O = [0, 0] }
crank = { points = { O = [0, 0], P = [0.2, 0] } }
rod = { points = { P = [0, 0], S = [0.6, 0] } }
ram = { points = { S = [0, 0] }, start = { x = 0.7, y = 0, phi = 0 }, mass = 1 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "ram.S"] }
guide = { type = "translational", between = ["ground.O", "ram.S"] }
[drivers]
crank = { type = "angle", of = "crank", LAW }
[measures]
stroke = { type = "range", of = "ram.x" }
"""


def _stroke(low: float, high: float) -> float:
    """Return the stroke of the ram while the crank moves between two angles, from its formula."""
    inside = [k * math.pi for k in range(-2, 4) if low <= k * math.pi <= high]
    x = [0.2 * math.cos(u) + math.sqrt(0.36 - 0.04 * math.sin(u) ** 2) for u in (low, high, *inside)]
    return max(x) - min(x)


@pytest.mark.parametrize(
    ("speed", "shown"),
    [('"600 rpm"', "600 rpm"), ('"90 deg/s"', "90 deg/s"), ("62.83185307179586", "600 rpm"), ("3", "3 rad/s")],
)
def test_a_speed_is_in_the_unit_of_the_file(speed: str, shown: str) -> None:
    report = kinfmu.check(parse(SLIDER_CRANK.replace("LAW", f'law = "constant_speed", speed = {speed}')))
    assert report.measured is not None
    assert report.measured.over == f"one turn of crank at {shown}"


CYCLE, RUN, PER_RAD = "one turn of crank at 3 rad/s", "the run of the file, t = 0 to 2 s", "1 rad/s, so that rates are"
LAWS = [
    ('law = "constant_speed", start = 1, speed = 3', CYCLE, (0.0, math.tau)),
    ('law = "polynomial", coefficients = [1, 3]', CYCLE, (0.0, math.tau)),
    ('law = "external", start = 1', PER_RAD, (0.0, math.tau)),
    ('law = "constant", level = 1', PER_RAD, (0.0, math.tau)),
    ('law = "polynomial", coefficients = [1, 0.1, 0.2]', RUN, (1.0, 2.0)),
    (
        'law = "harmonic", start = "90 deg", amplitude = "30 deg", frequency = "1 Hz"',
        RUN,
        (math.pi / 3, 2 * math.pi / 3),
    ),
    ('law = "cycloidal", start = 0.5, rise = -1.5, duration = 1', RUN, (-1.0, 0.5)),
    ('law = "spline", points = [[0, 1], [0.5, 1.2], [1, 2], [2, 1.5]], ends = "natural"', RUN, None),
    (
        'law = "sequence", segments = [{ law = "dwell", duration = 1 }, { law = "3-4-5", rise = 0.5, duration = 1 }]',
        RUN,
        (0.0, 0.5),
    ),
]


@pytest.mark.parametrize(("law", "over", "angles"), LAWS)
@pytest.mark.few(2)
def test_a_law_of_constant_speed_is_measured_over_its_cycle_and_others_over_the_run(
    law: str, over: str, angles: tuple[float, float] | None
) -> None:
    report = kinfmu.check(parse(SLIDER_CRANK.replace("LAW", law)))
    assert report.measured is not None
    assert report.loading is not None
    assert over in report.measured.over
    assert report.measured.over == report.loading.over
    assert unwrapped(report).count(f"Over {report.loading.over}") == 1
    assert "Over the same motion" in unwrapped(report)
    if angles:
        assert report.measured.values[0].value == pytest.approx(_stroke(*angles), rel=1e-9)


@pytest.mark.parametrize(("law", "over"), [(law, over) for law, over, _ in LAWS])
@pytest.mark.few(2)
def test_the_file_chooses_the_motion_that_is_measured(law: str, over: str) -> None:
    text = SLIDER_CRANK.replace("LAW", law)
    turned = kinfmu.check(parse(text.replace("step = 0.005", 'step = 0.005, over = "turn"')))
    assert turned.measured is not None
    assert turned.loading is not None
    assert turned.measured.over == turned.loading.over
    assert turned.measured.over.startswith("one turn of crank at ")
    assert turned.measured.values[0].value == pytest.approx(0.4, rel=1e-9)
    run = kinfmu.check(parse(text.replace("step = 0.005", 'step = 0.005, over = "run"')))
    assert run.measured is not None
    assert run.measured.over == RUN
    if over == CYCLE:
        assert run.measured.values[0].value == pytest.approx(0.4, rel=1e-9)  # nearly a turn, 1 to 7 rad
    saved = parse(toml_text.text(turned.mechanism))
    assert (saved.run.over, saved) == ("turn", turned.mechanism)


def test_a_turn_that_the_driver_cannot_make_is_refused_with_the_reason() -> None:
    mechanism = kinfmu.load("triple_rocker")
    mechanism = replace(mechanism, run=replace(mechanism.run, over="turn"), measures=(Range("swing", "right.phi"),))
    text = unwrapped(kinfmu.check(mechanism))
    assert "swing: no value, because over = 'turn' needs a single driver that turns all the way round" in text
    with pytest.raises(kinfmu.KinfmuError, match=r"\[run\] over = 'cycle' must be 'run' or 'turn'"):
        parse('name = "a"\nrun.over = "cycle"\n')


def test_a_study_measures_the_motion_that_check_measures() -> None:
    for law, over, _ in LAWS:
        mechanism = parse(SLIDER_CRANK.replace("LAW", law).replace("[0.2, 0]", '["r", 0]') + "[parameters]\nr = 0.2\n")
        study = define(mechanism, {"r": {"values": [0.2, 0.21]}})
        assert over in study.motion.over


# --------------------------------------------------------------------------------------------------------- measure text


_MEASURES = """
[measures.transmission]
type = "transmission_angle"
coupler = ["coupler.P", "coupler.Q"]
output = ["rocker.C", "rocker.Q"]
[measures.swing]
type = "range"
of = "rocker.phi"
"""


def test_reports_and_pictures_state_that_a_transmission_angle_counts_from_90_deg() -> None:
    text = toml_text.text(kinfmu.load("crank_rocker"))
    report = unwrapped(kinfmu.check(parse(text + _MEASURES)))
    (line,) = (line for line in report.splitlines() if line.startswith(" transmission ") and "angle" not in line)
    assert " deg from 90 deg " in line
    (swing,) = (line for line in report.splitlines() if line.startswith(" swing "))
    assert "from" not in swing
    column = Quantities("transmission", "deg", np.zeros(1), counted_from("transmission_angle"))
    assert column.label == "transmission from 90 deg [deg]"
    assert Quantities("swing", "deg", np.zeros(1), counted_from("range")).label == "swing [deg]"


@pytest.mark.long
def test_fits_state_that_a_transmission_angle_counts_from_90_deg() -> None:
    text = toml_text.text(kinfmu.load("crank_rocker")).replace("Q = [50.0, 0.0], tracer", 'Q = ["q", 0.0], tracer')
    mechanism = parse(text + _MEASURES + '[parameters]\nq = "50 mm"\n')
    problem = kinfmu.FitProblem(
        mechanism,
        unknowns={"q": ("49 mm", "52 mm")},
        targets=[MeasureTarget(name="wanted", of="transmission", value="66 deg")],
        constraints=[MeasureConstraint(name="limit", of="transmission", maximum="80 deg")],
    )
    lines = str(kinfmu.fit(problem, starts=1)).splitlines()
    (target,) = (line for line in lines if line.startswith("wanted (measure): "))
    assert " deg from 90 deg, error " in target
    (constraint,) = (line for line in lines if "transmission_angle = " in line)
    assert " deg from 90 deg, at most 80 deg" in constraint
