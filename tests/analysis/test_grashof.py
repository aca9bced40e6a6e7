"""Grashof's condition and transmission angles of four-bars and slider-cranks."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import Angle, AngleDriver, Body, ConstantSpeed, Coordinate, Distance, PointOnLine, Revolute, Translational
from kinfmu.analysis.loops import four_bar_class, named_loops, slider_crank_class
from kinfmu.analysis.transmission import TransmissionRange
from tests.analysis.linkages import digger, five_bar_arm, pinned_by_coordinates, pushed_crank
from tests.mechanisms import bar_as_body, bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank
from tests.reports import unwrapped


def turns_round(a: float, b: float, c: float, d: float) -> bool:
    """True if neighbours a and b of a loop a, b, c, d turn all the way round: the diagonal always joins c and d."""
    return a + b <= c + d and abs(a - b) >= abs(c - d)


def test_classes_of_random_lengths_say_which_links_turn() -> None:
    rng = np.random.default_rng(1883)
    seen = set()
    for _ in range(2000):
        ground, first, coupler, last = lengths = tuple(map(float, rng.uniform(0.2, 3.0, 4)))
        kind = four_bar_class(*lengths)
        seen.add(kind.name)
        if 2.0 * max(lengths) > sum(lengths):
            assert kind.name == "does not close"
            continue
        turning = (
            turns_round(ground, first, coupler, last),
            turns_round(ground, last, coupler, first),
            turns_round(first, coupler, last, ground),
        )
        expected = {
            (True, False, True): "crank-rocker",
            (False, True, False): "rocker-crank",
            (True, True, False): "double crank",
            (False, False, True): "double rocker",
            (False, False, False): "triple rocker",
        }
        assert kind.name == expected[turning]
        assert (kind.small < kind.large) == any(turning)
    assert seen == {
        "does not close",
        "crank-rocker",
        "rocker-crank",
        "double crank",
        "double rocker",
        "triple rocker",
    }


@pytest.mark.parametrize(
    ("lengths", "shape"),
    [
        ((2, 1, 2, 1), "parallelogram"),
        ((1, 1, 1, 1), "parallelogram"),
        ((3, 3, 1, 1), "kite"),
        ((3, 1, 1, 3), "kite"),
        ((4, 1, 3, 2), ""),
        ((0.7, 0.1, 0.5, 0.3), ""),
    ],
)
def test_equal_sums_are_change_points(lengths: tuple[float, float, float, float], shape: str) -> None:
    kind = four_bar_class(*lengths)
    assert (kind.name, kind.shape) == ("change point", shape)


def test_slider_crank_classes_of_random_lengths_say_which_links_turn() -> None:
    rng = np.random.default_rng(7)
    for _ in range(500):
        crank, rod, offset = map(float, rng.uniform([0.2, 0.2, -2.0], 3.0))
        heights = crank * np.sin(np.linspace(0.0, 2 * math.pi, 721))  # of the crank pin at every half degree
        reachable = np.abs(heights - offset) <= rod
        expected = "crank turns" if reachable.all() else "nothing turns"
        if not reachable.any():
            expected = "does not close"
        elif rod + abs(offset) < crank:
            expected = "rod turns"
        assert slider_crank_class(crank, rod, offset).name == expected
    assert slider_crank_class(1.0, 1.0, 0.0).name == "change point"
    assert slider_crank_class(0.7, 1.0, -0.3).name == "change point"


@pytest.mark.parametrize(
    "mechanism",
    [
        fourbar(4, 1, 3.5, 3),
        bar_linkage(),
        pinned_by_coordinates(4, 1, 3.5, 3),
        fourbar(4, 1, 3.5, 3, at=(7.0, -2.0)),
    ],
)
def test_a_four_bar_is_found_in_every_form(mechanism: kinfmu.Mechanism) -> None:
    (named,) = kinfmu.check(mechanism).loops
    assert named.loop.links == ("crank", "coupler", "rocker")
    assert named.loop.lengths == pytest.approx((4, 1, 3.5, 3), abs=1e-12)  # type: ignore[union-attr]
    assert named.grashof.name == "crank-rocker"


def test_a_four_bar_is_read_from_the_end_that_is_driven() -> None:
    mechanism = replace(fourbar(4, 1, 3.5, 3), drivers=(AngleDriver("swing", "rocker"),))
    (named,) = kinfmu.check(mechanism).loops
    assert named.loop.links == ("rocker", "coupler", "crank")
    assert named.grashof.name == "rocker-crank"


def test_redundant_bars_make_no_four_bars_of_their_own() -> None:
    for mechanism in (reference_fourbar(), bar_as_body()):
        (named,) = kinfmu.check(mechanism).loops
        assert named.grashof.shape == "parallelogram"


def test_a_six_bar_reports_its_four_bar_and_others_report_none() -> None:
    (named,) = kinfmu.check(six_bar()).loops
    assert named.loop.links == ("crank", "ternary", "rocker")
    assert kinfmu.check(five_bar()).loops == ()
    assert named_loops(digger()) == ((), ())


def test_pins_of_three_bodies_count_however_they_are_joined() -> None:
    mechanism = fourbar(4, 1, 3.5, 3)
    star = Body("star", {"Q": (0, 0), "end": (0, 1)}, (3, 2, 0))
    joints = [joint for joint in mechanism.joints if joint.name != "Q"]
    joints += [Revolute("Q1", ("coupler.Q", "star.Q")), Revolute("Q2", ("star.Q", "rocker.Q"))]
    four_bars, _ = named_loops(replace(mechanism, bodies=(*mechanism.bodies, star), joints=joints))
    assert [loop.links for loop in four_bars] == [("crank", "coupler", "rocker")]


def test_lengths_that_do_not_close_are_reported() -> None:
    mechanism = fourbar(4, 1, 3.5, 3)
    rocker = Body("rocker", {"C": (0, 0), "Q": (0.2, 0)}, (4, 0, 1))
    report = kinfmu.check(replace(mechanism, bodies=(*mechanism.bodies[:3], rocker), drivers=mechanism.drivers))
    assert report.loops[0].grashof.name != "does not close"
    rocker = Body("rocker", {"C": (0, 0), "Q": (9, 0)}, (4, 0, 1))
    report = kinfmu.check(replace(mechanism, bodies=(*mechanism.bodies[:3], rocker), drivers=mechanism.drivers))
    assert report.loops[0].grashof.name == "does not close"
    assert "poor ground, crank, coupler, rocker cannot close: longest 9 > the others 8.5" in unwrapped(report)
    assert isinstance(report.problem, kinfmu.KinfmuError)


def guided(kind: str, offset: float) -> kinfmu.Mechanism:
    """A slider-crank whose rod is guided in one way or another."""
    if kind == "slider":
        return pushed_crank(1.0, 3.0, offset)
    mechanism = slider_crank(1.0, 3.0, offset)
    ground, crank, rod = mechanism.bodies
    joints = mechanism.joints[:2]
    if kind == "coordinate":
        return mechanism
    ground = Body("ground", {**ground.points, "G": (5, offset)})
    if kind == "point on line":
        return replace(
            mechanism, bodies=(ground, crank, rod), joints=(*joints, PointOnLine("guide", ("ground.G", "rod.S")))
        )
    block = Body("block", {"S": (0.5, 0.25), "B": (0, 0)}, (3, offset - 0.25, 0))
    held = [
        Revolute("S", ("rod.S", "block.S")),
        Coordinate("height", "block.B", "y", offset - 0.25),
        Angle("upright", "block"),
    ]
    if kind == "held block":
        return replace(mechanism, bodies=(ground, crank, rod, block), joints=(*joints, *held))
    bar = Distance("rod", ("crank.P", "block.S"), 3.0)  # kind 'bar'
    return replace(mechanism, bodies=(ground, crank, block), joints=(joints[0], bar, *held[1:]), points={})


@pytest.mark.parametrize("kind", ["coordinate", "point on line", "slider", "held block", "bar"])
@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_a_slider_crank_is_found_in_every_form(kind: str, offset: float) -> None:
    (named,) = kinfmu.check(guided(kind, offset)).loops
    assert named.loop.crank.length == 1.0  # type: ignore[union-attr]
    assert named.loop.rod.length == pytest.approx(3.0)  # type: ignore[union-attr]
    assert abs(named.loop.offset) == pytest.approx(offset, abs=1e-12)  # type: ignore[union-attr]
    assert named.grashof.name == "crank turns"


def turning_number(points: list[tuple[float, float]]) -> int:
    """How often the direction turns round along a closed polygon: once, or not at all if its sides cross."""
    sides = [complex(*b) - complex(*a) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    turns = [cmath.phase(b / a) for a, b in zip(sides, sides[1:] + sides[:1], strict=True)]
    return abs(round(sum(turns) / math.tau))


@pytest.mark.long
def test_four_bars_are_open_or_crossed_as_assembled() -> None:
    rng = np.random.default_rng(12)
    seen = set()
    cases = [(tuple(map(float, rng.uniform(0.8, 2.0, 4))), float(rng.uniform(-3, 3))) for _ in range(24)]
    cases += [
        ((4.0, 1.0, 3.5, 3.0), -2.0),
        ((2.0, 1.0, 2.0, 1.0), 1.0),
        ((2.0, 2.0, 1.0, 1.0), 1.0),
        ((1.0, 2.0, 1.5, 1.5), 0.7),
    ]
    for lengths, start in cases:
        for branch in (1, -1):
            mechanism = fourbar(*lengths, start=start, branch=branch)
            report = kinfmu.check(mechanism)
            (named,) = report.loops
            if report.plan is None:  # the lengths do not close there
                assert named.assembly == ""
                continue
            at = {**report.plan.fixed, **dict(zip(mechanism.coordinate_names, report.plan.anchor.q, strict=True))}
            points = [place.world(at) for place in named.loop.pins]
            assert named.assembly == ("open" if turning_number(points) else "crossed")
            line = next(text for text in unwrapped(report).splitlines() if named.grashof.name in text)
            if named.grashof.shape.endswith("parallelogram"):
                assert named.grashof.shape == ("parallelogram" if named.assembly == "open" else "antiparallelogram")
                assert f" change point ({named.grashof.shape}) " in line
            else:
                assert f", {named.assembly} " in line
            assert named.as_json()["assembly"] == named.assembly
            seen.add((named.grashof.name, named.grashof.shape, named.assembly))
    assert {
        (name, "", assembly) for name in ("crank-rocker", "triple rocker") for assembly in ("open", "crossed")
    } <= seen
    assert {("change point", "parallelogram", "open"), ("change point", "antiparallelogram", "crossed")} <= seen


# --------------------------------------------------------------------------------------------------------- transmission


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
    report = kinfmu.check(fourbar(4, 2, 3, 3.5))
    assert f" coupler, rocker {least:.9g} deg 360 deg {most:.9g} deg 180 deg\n" in unwrapped(report)
    line = f"poor Transmission angle {least:.4g} deg between coupler and rocker (40 deg from 0 and 180 deg is usual)\n"
    assert line in unwrapped(report, detail=False)


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
    between = " and ".join(place.body for place in found.pins[::2])
    assert f" dyad between {between}\n" in unwrapped(kinfmu.check(mechanism))


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
    assert f" rod 120 dyad on {angle.output} between coupler\n" in unwrapped(report)
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
