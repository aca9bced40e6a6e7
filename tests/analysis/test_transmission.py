"""Transmission angles against the law of cosines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, PointOnLine, Revolute, Translational
from kinfmu.analysis.transmission import TransmissionRange
from tests.analysis.linkages import five_bar_arm, pushed_crank
from tests.mechanisms import bar_linkage, fourbar, reference_fourbar, six_bar, slider_crank


def opposite(side: float, b: float, c: float) -> float:
    """Angle opposite a side of a triangle [rad]."""
    return math.acos((b * b + c * c - side * side) / (2 * b * c))


def only(mechanism: kinfmu.Mechanism) -> TransmissionRange:
    (named,) = kinfmu.check(mechanism).loops
    (angle,) = named.transmission
    return angle


def test_extremes_of_crank_rockers_are_where_the_crank_lies_along_the_ground() -> None:
    rng = np.random.default_rng(42)
    found = 0
    while found < 6:
        ground, crank, coupler, rocker = lengths = tuple(map(float, rng.uniform(0.5, 4.0, 4)))
        if crank != min(lengths) or crank + max(lengths) > 0.5 * sum(lengths) - 0.1:
            continue
        found += 1
        angle = only(fourbar(*lengths, start=float(rng.uniform(-3, 3)), branch=1 if found % 2 else -1))
        assert (angle.coupler, angle.output, angle.is_slide) == ("coupler", "rocker", False)
        assert angle.smallest == pytest.approx(opposite(ground - crank, coupler, rocker), abs=1e-12)
        assert angle.largest == pytest.approx(opposite(ground + crank, coupler, rocker), abs=1e-12)
        assert math.remainder(angle.at_smallest, math.tau) == pytest.approx(0.0, abs=1e-11)
        assert angle.at_largest == pytest.approx(math.pi, abs=1e-11)


def test_the_verdict_follows_the_worst_angle() -> None:
    assert only(fourbar(4, 1, 3.5, 3)).verdict == "good"
    poor = only(fourbar(4, 2, 3, 3.5))
    assert poor.verdict == "poor"
    assert poor.worst == pytest.approx(opposite(2, 3, 3.5), abs=1e-12)
    assert only(fourbar(2, 1, 2, 1)).verdict == "locks"
    least, most = (math.degrees(opposite(side, 3, 3.5)) for side in (2, 6))
    assert (
        f"transmission angle {least:.6g} deg (crank at 360 deg) to {most:.6g} deg (crank at 180 deg): "
        "poor (40 deg from 0 and 180 deg is usual)"
    ) in str(kinfmu.check(fourbar(4, 2, 3, 3.5)))


def test_a_bar_as_coupler_transmits_as_a_body_does() -> None:
    angle, same = only(bar_linkage()), only(fourbar(4, 1, 3.5, 3))
    assert (angle.smallest, angle.largest) == pytest.approx((same.smallest, same.largest), abs=1e-12)


def test_a_triple_rocker_locks_at_its_limits() -> None:
    angle = only(fourbar(4.0, 3.0, 1.5, 1.0, start=0.2))
    assert angle.largest == math.pi
    assert angle.smallest == pytest.approx(opposite(1.0, 1.5, 1.0), abs=1e-12)
    assert angle.at_smallest == pytest.approx(0.0, abs=1e-11)
    limit = math.acos((16 + 9 - 2.5**2) / 24)
    assert angle.in_line_at == pytest.approx((-limit, limit), abs=1e-10)


def test_a_parallelogram_falls_in_line_at_its_change_points() -> None:
    angle = only(reference_fourbar())
    assert (angle.smallest, angle.largest) == pytest.approx((0.0, math.pi), abs=1e-6)
    assert math.remainder(angle.at_smallest, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert angle.at_largest == pytest.approx(math.pi, abs=1e-9)


@pytest.mark.parametrize(("rod", "offset"), [(3.0, 0.0), (3.0, 0.5), (2.2, -0.4)])
def test_extremes_of_a_slider_crank_are_where_its_crank_stands_across(rod: float, offset: float) -> None:
    angle = only(slider_crank(1.0, rod, offset))
    assert (angle.coupler, angle.is_slide) == ("rod", True)
    assert angle.smallest == pytest.approx(math.acos((offset + 1.0) / rod), abs=1e-12)
    assert angle.largest == pytest.approx(math.acos((offset - 1.0) / rod), abs=1e-12)
    assert angle.at_smallest == pytest.approx(1.5 * math.pi, abs=1e-11)
    assert angle.at_largest == pytest.approx(0.5 * math.pi, abs=1e-11)


def test_a_slider_that_drives_pushes_the_crank_from_line_to_line() -> None:
    angle = only(pushed_crank(1.0, 2.5, 0.3))
    assert (angle.coupler, angle.output, angle.kind) == ("rod", "crank", "length")
    assert (angle.smallest, angle.largest) == (0.0, math.pi)
    assert angle.at_smallest == pytest.approx(math.sqrt(1.5**2 - 0.09), abs=1e-10)
    assert angle.at_largest == pytest.approx(math.sqrt(3.5**2 - 0.09), abs=1e-10)


def test_loops_that_no_end_leads_have_no_transmission_angle() -> None:
    (named,) = kinfmu.check(six_bar()).loops
    assert named.transmission == ()
    by_coupler = replace(fourbar(4, 1, 3.5, 3), drivers=(AngleDriver("tilt", "coupler", ConstantSpeed(0.6, 1.0)),))
    (named,) = kinfmu.check(by_coupler).loops
    assert named.transmission == ()
    assert kinfmu.check(five_bar_arm()).loops == ()


def sampled(mechanism: kinfmu.Mechanism, first: str, middle: str, second: str, **inputs: np.ndarray) -> np.ndarray:
    """The angle [rad] at the point `middle` between the points `first` and `second`, at driver values."""
    run = kinfmu.solve(mechanism, **inputs)

    def place(point: str) -> np.ndarray:
        body, _, _ = point.partition(".")
        a, b = mechanism.body_points[point]
        x, y, phi = (run[f"{body}.{axis}"] for axis in ("x", "y", "phi"))
        return np.array([x + np.cos(phi) * a - np.sin(phi) * b, y + np.sin(phi) * a + np.cos(phi) * b])

    one, other = place(first) - place(middle), place(second) - place(middle)
    return np.asarray(np.arccos((one * other).sum(axis=0) / (np.hypot(*one) * np.hypot(*other))))


@pytest.mark.parametrize(
    ("name", "links", "joint", "points"),
    [
        ("watt_six_bar", ("left", "right"), "T", ("left.R", "left.T", "right.S")),
        ("jansen_leg", ("leg", "link"), "knee", ("leg.bottom", "leg.knee", "link.left")),
        ("geared_five_bar", ("left", "right"), "T", ("left.P", "left.T", "right.Q")),
    ],
)
@pytest.mark.few(1)
def test_a_dyad_between_moving_bodies_has_its_transmission_angle(
    name: str, links: tuple[str, str], joint: str, points: tuple[str, str, str]
) -> None:
    mechanism = kinfmu.load(name)
    (found,) = kinfmu.check(mechanism).dyads
    assert {found.dyad.first.name, found.dyad.second.name} == {*links}
    assert found.dyad.joint == joint
    (angle,) = found.transmission
    (driver,) = mechanism.drivers
    values = sampled(mechanism, *points, **{f"{driver.name}_angle": np.linspace(0.0, math.tau, 7201)})
    assert angle.smallest == pytest.approx(values.min(), abs=1e-6)
    assert angle.largest == pytest.approx(values.max(), abs=1e-6)
    at = sampled(mechanism, *points, **{f"{driver.name}_angle": np.array([angle.at_smallest, angle.at_largest])})
    assert at == pytest.approx([angle.smallest, angle.largest], abs=1e-12)
    text = str(kinfmu.check(mechanism))
    assert f"; they meet at {joint}, between {' and '.join(place.body for place in found.pins[::2])}" in text


@pytest.mark.parametrize("has_slider", [True, False])
def test_a_slide_moved_by_a_point_of_a_coupler_has_its_transmission_angle(has_slider: bool) -> None:
    four, direction, length = kinfmu.load("crank_rocker"), 0.2, 120.0
    rod = Body("rod", {"T": (0, 0), "S": (length, 0)}, (40.0, 95.0, 0.5))
    joints = [*four.joints, Revolute("T", ("coupler.tracer", "rod.T"))]
    bodies = [replace(four.bodies[0], points={**four.bodies[0].points, "W": (0, 120)}), *four.bodies[1:], rod]
    if has_slider:
        bodies.append(Body("slider", {"S": (0, 0)}, (145.0, 150.0, direction)))
        joints.append(Revolute("S", ("rod.S", "slider.S")))
        joints.append(Translational("way", ("ground.W", "slider.S"), axis=direction, angle=direction))
    else:
        joints.append(PointOnLine("way", ("ground.W", "rod.S"), axis=direction))
    mechanism = replace(four, bodies=tuple(bodies), joints=tuple(joints))
    report = kinfmu.check(mechanism)
    (found,) = report.dyads
    (angle,) = found.transmission
    assert (angle.coupler, angle.output, angle.is_slide) == ("rod", "slider" if has_slider else "way", True)
    run = kinfmu.solve(mechanism, crank_angle=np.linspace(0.0, math.tau, 3601))
    values = np.arccos(np.sin(run["rod.phi"] - direction))  # the normal is 90 degrees ahead of the direction
    assert angle.smallest == pytest.approx(values.min(), abs=1e-6)
    assert angle.largest == pytest.approx(values.max(), abs=1e-6)
    assert f"dyad        rod 120 mm between coupler and the slide {angle.output}" in str(report)
    assert report.as_json()["dyads"][0]["lengths"] == {"rod": 120.0}


def test_a_dyad_belongs_to_the_drivers_that_move_it() -> None:
    (found,) = kinfmu.check(kinfmu.load("excavator")).dyads
    assert [angle.driver for angle in found.transmission] == ["bucket_cylinder"]
    (found,) = kinfmu.check(kinfmu.load("five_bar")).dyads
    assert [angle.driver for angle in found.transmission] == ["left", "right"]
    assert found.transmission[0].in_line_at
    assert {angle.verdict for angle in found.transmission} == {"locks"}


@pytest.mark.parametrize("name", ["crank_rocker", "slider_crank", "toggle_press", "stephenson_six_bar", "scotch_yoke"])
def test_pairs_of_links_of_a_loop_and_links_that_nothing_moves_alone_are_no_further_dyads(name: str) -> None:
    report = kinfmu.check(kinfmu.load(name))
    assert report.dyads == ()
    assert report.as_json()["dyads"] == []


def test_an_extreme_between_the_last_pose_and_a_limit_is_found() -> None:
    mechanism = kinfmu.load("excavator")
    report = kinfmu.check(mechanism)
    (found,) = report.dyads
    (angle,) = found.transmission
    reach = next(one for one in report.ranges if one.driver == angle.driver)
    assert reach.high is not None
    starts = zip(mechanism.drivers, report.starts, strict=True)
    inputs = {f"{driver.name}_length": np.full(4001, value) for driver, value in starts}
    inputs[f"{angle.driver}_length"] = np.linspace(reach.high - 0.05, reach.high - 1e-9, 4001)
    values = sampled(mechanism, "bucket.Q", "bucket.M", "idler.N", **inputs)
    assert angle.smallest == pytest.approx(values.min(), abs=1e-8)
    assert angle.smallest < values[-1] - 0.05
    assert angle.at_smallest < reach.high - 0.01
