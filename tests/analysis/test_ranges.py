"""Ranges of drivers, limit positions and change points against closed forms."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    Gear,
    Mechanism,
    RackAndPinion,
    Revolute,
    RunSettings,
    Translational,
)
from kinfmu.analysis.driver_path import follow
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Pose
from tests.analysis.linkages import digger, five_bar_arm, pushed_crank
from tests.mechanisms import five_bar, fourbar, slider_crank, tight_jaw, with_arm
from tests.reports import unwrapped


def dead_centres(ground: float, crank: float, reach: float) -> float:
    """Crank angle at which coupler and rocker, in line, span `reach`: law of cosines [rad]."""
    return math.acos((ground**2 + crank**2 - reach**2) / (2 * ground * crank))


@pytest.mark.parametrize("lengths", [(4.0, 3.0, 1.5, 1.0), (3.0, 2.5, 2.0, 1.0), (5.0, 3.3, 2.9, 0.5)])
def test_limits_of_four_bars_are_where_coupler_and_rocker_fall_in_line(lengths: tuple[float, ...]) -> None:
    ground, crank, coupler, rocker = lengths
    exact = dead_centres(ground, crank, coupler + rocker)
    inner = abs(coupler - rocker) > abs(ground - crank)
    least = dead_centres(ground, crank, abs(coupler - rocker)) if inner else -exact
    start = 0.5 * (exact + (least if inner else 0.0))
    report = kinfmu.check(fourbar(*lengths, start=start))
    assert report.range is not None
    assert report.range.high == pytest.approx(exact, abs=1e-10)
    assert report.range.low == pytest.approx(least, abs=1e-10)
    assert {point.kind for point in report.singular} == {"limit"}
    assert "coupler and rocker fall in line" in unwrapped(report)


def test_the_position_at_a_limit_is_reported() -> None:
    report = kinfmu.check(fourbar(4.0, 3.0, 1.5, 1.0, start=0.2))
    assert report.range is not None
    assert report.range.highest is not None
    at, limit = report.range.highest.coordinates, dead_centres(4.0, 3.0, 2.5)
    px, py = 3.0 * math.cos(limit), 3.0 * math.sin(limit)
    lean = math.atan2(-py, 4.0 - px)  # all of coupler and rocker point along the diagonal
    assert at["crank.phi"] == pytest.approx(limit, abs=1e-10)
    assert at["coupler.x"] == pytest.approx(px, abs=1e-8)
    assert math.remainder(at["coupler.phi"] - lean, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert math.remainder(at["rocker.phi"] - lean - math.pi, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert at["rocker.x"] == 4.0
    assert report.range.highest.bodies == ("coupler", "rocker")


@pytest.mark.parametrize(("crank", "rod", "offset"), [(2.0, 1.0, 0.0), (2.0, 1.2, 0.5), (1.0, 1.5, -0.8)])
def test_limits_of_a_slider_crank_are_where_the_rod_stands_across_the_slide(
    crank: float, rod: float, offset: float
) -> None:
    start = math.asin(offset / crank)  # the rod along the slide
    report = kinfmu.check(slider_crank(crank, rod, offset, start))
    assert report.range is not None
    for end, side in ((report.range.low, -1.0), (report.range.high, 1.0)):
        sine = (offset + side * rod) / crank
        expected = math.asin(sine) if abs(sine) < 1.0 else side * math.pi - math.asin((offset - side * rod) / crank)
        assert end == pytest.approx(expected, abs=1e-10)
    assert "rod is perpendicular to the slide" in unwrapped(report)


def test_a_slider_that_drives_goes_from_crank_and_rod_folded_to_stretched() -> None:
    crank, rod, offset = 1.0, 2.5, 0.3
    report = kinfmu.check(pushed_crank(crank, rod, offset))
    assert report.range is not None
    assert report.range.kind == "length"
    assert report.range.low == pytest.approx(math.sqrt((rod - crank) ** 2 - offset**2), abs=1e-10)
    assert report.range.high == pytest.approx(math.sqrt((rod + crank) ** 2 - offset**2), abs=1e-10)
    assert "rod and crank fall in line" in unwrapped(report)


def test_each_driver_of_a_five_bar_goes_until_its_arms_are_straight() -> None:
    upper, (left, right) = 1.5, (1.2, 2.0)
    report = kinfmu.check(five_bar_arm(upper, (left, right)))
    assert report.range is None
    assert [reach.driver for reach in report.ranges] == ["shoulder", "elbow"]
    qx, qy = 3.0 + math.cos(right), math.sin(right)
    away, lean = math.hypot(qx, qy), math.atan2(qy, qx)
    half = math.acos((1.0 + away**2 - (2 * upper) ** 2) / (2 * away))  # |P - Q| = 2 upper
    shoulder, elbow = report.ranges
    assert shoulder.low == pytest.approx(lean - half, abs=1e-10)
    assert shoulder.high == pytest.approx(lean + half, abs=1e-10)
    px, py = math.cos(left) - 3.0, math.sin(left)
    away, lean = math.hypot(px, py), math.atan2(py, px)
    half = math.acos((1.0 + away**2 - (2 * upper) ** 2) / (2 * away))
    assert elbow.low == pytest.approx(lean - half, abs=1e-10)
    assert elbow.high == pytest.approx(lean + half, abs=1e-10)
    text = unwrapped(report)
    assert "Range of each driver, the others at their start values" in text
    assert text.count("dead centre at both ends, forearm and strut fall in line") == 2


@pytest.mark.long
def test_links_of_a_loop_without_a_name_fall_in_line_too() -> None:
    """A link from a point of the coupler to a lever that carries a rod and a block: a dead centre of this dyad."""
    text = """
name = "feeder"
units.length = "mm"
bodies.ground.points = { O = [0, 0], C = [70, 0], D = [190, 0] }
bodies.crank = { points = { O = [0, 0], P = [20, 0] }, start = { phi = 0 } }
bodies.coupler = { points = { P = [0, 0], Q = [65, 0], R = [65, 30] }, start = { phi = "20 deg" } }
bodies.rocker = { points = { C = [0, 0], Q = [40, 0] }, start = { phi = "90 deg" } }
bodies.link = { points = { R = [0, 0], S = [105, 0] }, start = { phi = 0 } }
bodies.lever = { points = { D = [0, 0], S = [55, 0], T = [20, 0] }, start = { phi = "90 deg" } }
bodies.rod = { points = { T = [0, 0], B = [60, 0] }, start = { phi = 0 } }
bodies.block = { points = { B = [0, 0] }, start = { x = 250, phi = 0 } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "coupler.P"] }
joints.Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
joints.C = { type = "revolute", between = ["ground.C", "rocker.C"] }
joints.R = { type = "revolute", between = ["coupler.R", "link.R"] }
joints.S = { type = "revolute", between = ["lever.S", "link.S"] }
joints.D = { type = "revolute", between = ["ground.D", "lever.D"] }
joints.T = { type = "revolute", between = ["lever.T", "rod.T"] }
joints.B = { type = "revolute", between = ["rod.B", "block.B"] }
joints.guide = { type = "translational", between = ["ground.O", "block.B"] }
drivers.motor = { type = "angle", of = "crank", law = "constant_speed", start = 0, speed = "60 rpm" }
"""
    report = kinfmu.check(parse(text))
    (reach,) = report.ranges
    for limit in reach.limits:
        assert limit.bodies == ("link", "lever", "rod", "block")
        at = limit.coordinates
        assert math.sin(at["link.phi"] - at["lever.phi"]) == pytest.approx(0.0, abs=1e-5)
    assert len(reach.limits) == 2
    assert "; dead centre at both ends, link and lever fall in line\n" in unwrapped(report)


def test_cylinders_go_as_far_as_their_triangles() -> None:
    foot, lug = 1.1, 2.0
    report = kinfmu.check(digger(foot, lug))
    lift, crowd = report.ranges
    assert (lift.driver, lift.kind) == ("lift", "length")
    assert lift.low == pytest.approx(abs(foot - lug), abs=1e-10)
    assert lift.high == pytest.approx(foot + lug, abs=1e-10)
    rear, tail = math.hypot(4 - 2.5, 0.4), math.hypot(0.7, 0.2)
    assert crowd.low == pytest.approx(abs(rear - tail), abs=1e-10)
    assert crowd.high == pytest.approx(rear + tail, abs=1e-10)


def test_a_cylinder_that_closes_wholly_ends_at_zero() -> None:
    report = kinfmu.check(digger(foot=2.0, lug=2.0))
    assert report.ranges[0].low == pytest.approx(0.0, abs=1e-12)
    assert report.ranges[0].high == pytest.approx(4.0, abs=1e-10)
    assert [point.kind for point in report.ranges[0].points] == ["limit", "limit"]
    assert " lift distance 0 at the lower end; dead centre at the upper end 0 m 4 m\n" in unwrapped(report)


def test_a_place_where_the_solver_stops_at_crossing_branches_is_not_called_a_dead_centre() -> None:
    report = kinfmu.check(tight_jaw())
    (reach,) = report.ranges
    assert reach.lowest is not None
    assert reach.highest is not None
    dead_centre = math.sqrt((math.hypot(6.05, 19.06) + 40) ** 2 - 25**2)  # crank and rod in line
    assert (reach.lowest.value, reach.lowest.kind) == (pytest.approx(-dead_centre, abs=1e-9), "dead centre")
    assert reach.highest.kind == "change point"
    assert reach.highest.value < dead_centre - 0.2
    assert "; branches cross and the motion cannot continue at the upper end" in unwrapped(report)


def test_a_crossing_near_a_dead_centre_is_bridged_and_the_dead_centre_is_the_limit() -> None:
    (reach,) = kinfmu.check(kinfmu.load("parallel_jaw")).ranges
    dead_centre = math.sqrt((20 + 40) ** 2 - 25**2)  # crank and rod in line
    assert (reach.low, reach.high) == (pytest.approx(-dead_centre, abs=1e-9), pytest.approx(dead_centre, abs=1e-9))
    crossings = [point.value for point in reach.points if point.kind == "change point"]
    up = math.sqrt(40**2 - 25**2)
    np.testing.assert_allclose(crossings, [20 - up, 20 + up], atol=1e-8)


def test_a_rack_goes_more_than_a_turn_to_either_limit() -> None:
    (reach,) = kinfmu.check(kinfmu.load("rack_steering")).ranges
    assert reach.low is not None
    assert reach.high is not None
    assert reach.low == pytest.approx(-reach.high, abs=1e-9)
    assert reach.high > math.tau


def test_change_points_show_with_several_drivers_too() -> None:
    report = kinfmu.check(with_arm(fourbar(2, 1, 2, 1)))
    crank, arm_alone = report.ranges
    np.testing.assert_allclose(
        [point.value for point in crank.points], [math.pi, math.tau], atol=1e-11
    )  # from 1 rad on
    assert arm_alone.points == ()
    places = "crank = 180 deg, 360 deg"
    assert f"poor Branches cross at {places}; with several drivers no run can cross it" in unwrapped(report)


def test_a_geared_linkage_turns_until_it_is_back() -> None:
    mechanism = Mechanism(
        "gears",
        [
            Body("ground", {"A": (0, 0), "B": (3, 0)}),
            Body("wheel", {"A": (0, 0)}, (0, 0, 0.4)),
            Body("pinion", {"B": (0, 0)}, (3, 0, 0.6)),
        ],
        [
            Revolute("A", ("ground.A", "wheel.A")),
            Revolute("B", ("ground.B", "pinion.B")),
            Gear("mesh", ("wheel", "pinion"), ratio=2.0 / 3.0),
        ],
        [AngleDriver("drive", "wheel", ConstantSpeed(0.4, 1.0))],
    )
    (reach,) = kinfmu.check(mechanism).ranges
    turns_of_pinion = abs(float(kinfmu.solve(mechanism, drive_angle=[0.4]).rates[0][1]))
    assert reach.turns == 3
    assert reach.turns * turns_of_pinion == pytest.approx(round(reach.turns * turns_of_pinion), abs=1e-12)


COUPLED = """
name = "coupled"
[bodies]
ground.points = {{ O = [0, 0], W = [1, 0] }}
crank.points = {{ O = [0, 0] }}
arm.points = {{ W = [0, 0] }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
W = {{ type = "revolute", between = ["ground.W", "arm.W"] }}
[joints.law]
type = "coupling"
input = {{ measure = "angle", of = "crank" }}
output = {{ measure = "angle", of = "arm" }}
{law}
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
speed = "60 rpm"
"""


def sequence(*rises: str, repeat: str = "true") -> str:
    """A law of one whole turn for each entry: the arm rises by it and returns; none for "0 deg"."""
    parts = []
    for rise in rises:
        up = f'{{ law = "cycloidal", rise = "{rise}", duration = "90 deg" }}'
        down = f'{{ law = "cycloidal", rise = "-{rise}", duration = "90 deg" }}'
        parts += [up, down, '{ law = "dwell", duration = "180 deg" }']
    return f'law = "sequence"\nrepeat = {repeat}\nsegments = [{", ".join(parts)}]'


@pytest.mark.parametrize(
    ("law", "turns"),
    [
        ('law = "harmonic"\namplitude = "30 deg"\nfrequency = 0.5', 2),  # back after one turn, with another rate
        ('law = "harmonic"\namplitude = "30 deg"\nfrequency = 1.5', 2),
        ('law = "harmonic"\namplitude = "30 deg"\nfrequency = 0.5\nphase = "90 deg"', 2),
        ('law = "harmonic"\namplitude = "30 deg"\nfrequency = 2', 1),
        (sequence("20 deg", "30 deg"), 2),  # at rest after every turn
        (sequence("20 deg", "20 deg", "30 deg"), 3),
        (sequence("20 deg", "30 deg", "20 deg", "25 deg"), 4),
        (sequence("20 deg", repeat="false"), None),
        (sequence("20 deg", repeat="false") + '\nbegin = "-200 deg"', None),  # over before the crank starts
    ],
)
@pytest.mark.few(6)
def test_a_mechanism_repeats_where_the_motion_does_not_only_the_pose(law: str, turns: int | None) -> None:
    report = kinfmu.check(parse(COUPLED.format(law=law)))
    assert report.range is not None
    assert report.range.turns == turns
    if turns is None:
        assert re.search(r"one driver: crank from .* without a limit\n", unwrapped(report))


def test_a_rack_never_comes_back_and_has_no_limit() -> None:
    mechanism = Mechanism(
        "rack_drive",
        [
            Body("ground", {"O": (0, 0), "G": (0, -1)}),
            Body("pinion", {"O": (0, 0)}, (0, 0, 0)),
            Body("rack", {"G": (0, 0)}, (0, -1, 0)),
        ],
        [
            Revolute("O", ("ground.O", "pinion.O")),
            Translational("slide", ("ground.G", "rack.G")),
            RackAndPinion("mesh", ("ground.G", "rack.G"), "pinion", 1.0),
        ],
        [AngleDriver("drive", "pinion", ConstantSpeed(0.0, 1.0))],
    )
    report = kinfmu.check(mechanism)
    assert report.range is not None
    assert (report.range.low, report.range.high, report.range.turns) == (None, None, None)
    assert re.search(r"one driver: drive from .* without a limit\n", unwrapped(report))


def test_a_run_past_the_range_is_noted() -> None:
    swinging = fourbar(4.0, 3.0, 1.5, 1.0, start=0.2)
    report = kinfmu.check(replace(swinging, run=RunSettings(0.0, 2.0, 0.1)))
    assert report.notes == (
        "[run] takes crank from 0.2 rad (11.4591559 deg) to 2.2 rad (126.050715 deg): beyond the range",
    )
    toggle = " toggle crank, coupler fall in line at crank = 11.7158524 deg"
    shorter = kinfmu.check(replace(swinging, run=RunSettings(0.0, 0.4, 0.1)))
    assert toggle in unwrapped(report).splitlines()
    assert toggle in unwrapped(shorter).splitlines()


def test_a_run_of_several_drivers_that_stops_is_noted_with_its_time() -> None:
    stretched = replace(five_bar_arm(), run=RunSettings(0.0, 40.0, 0.1))
    (note,) = kinfmu.check(stretched).notes
    assert note.startswith("[run] at t = ")
    assert "cannot be reached: to these digits it is the limit" in note
    assert kinfmu.check(replace(five_bar(), run=RunSettings(0.0, 0.5, 0.1))).notes == ()


@pytest.mark.parametrize("power", [1, 3, 9])
@pytest.mark.parametrize("place", [1.3, 2.0 + 1e-9, 5.0])
def test_the_place_where_a_value_changes_its_sign_is_found_to_round_off(place: float, power: int) -> None:
    path = follow(compile_plan(fourbar(4.0, 1.0, 3.0, 3.0)), 0)
    low = max((pose for pose in path.poses if pose.u[0] < place), key=lambda pose: pose.u[0])
    high = min((pose for pose in path.poses if pose.u[0] > place), key=lambda pose: pose.u[0])
    evaluated: list[float] = []

    def value(pose: Pose) -> float:
        evaluated.append(pose.u[0])
        return (pose.u[0] - place) ** power

    found = path.zero(value, low, high)
    assert found.u[0] == pytest.approx(place, abs=(1.0 + place) * 1e-15)
    assert len(evaluated) < (10 if power == 1 else 80)


def test_where_the_path_ends_before_a_sign_changes_the_last_pose_is_returned() -> None:
    path = follow(compile_plan(fourbar(4.0, 1.0, 3.0, 3.0)), 0)
    low, high = path.poses[:2]
    unsolvable: Any = SimpleNamespace(solve=lambda *_: SimpleNamespace(good=False))
    middle = 0.5 * (low.u[0] + high.u[0])
    assert replace(path, solver=unsolvable).zero(lambda pose: pose.u[0] - middle, low, high) is high
