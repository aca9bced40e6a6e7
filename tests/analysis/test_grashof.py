"""Classes of four-bars and slider-cranks against textbook inequalities, and finding the loops."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import Angle, AngleDriver, Body, Coordinate, Distance, PointOnLine, Revolute
from kinfmu.analysis.loops import four_bar_class, named_loops, slider_crank_class
from tests.analysis.linkages import digger, pinned_by_coordinates, pushed_crank
from tests.mechanisms import bar_as_body, bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank


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
    assert "does not close: its longest side (9) is longer than the others together (8.5)" in str(report)
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
            line = next(text for text in str(report).splitlines() if named.grashof.name in text)
            if named.grashof.shape.endswith("parallelogram"):
                assert named.grashof.shape == ("parallelogram" if named.assembly == "open" else "antiparallelogram")
                assert f"change point ({named.grashof.shape}): " in line
            else:
                assert f"{named.assembly} as assembled" in line
            assert named.as_json()["assembly"] == named.assembly
            seen.add((named.grashof.name, named.grashof.shape, named.assembly))
    assert {
        (name, "", assembly) for name in ("crank-rocker", "triple rocker") for assembly in ("open", "crossed")
    } <= seen
    assert {("change point", "parallelogram", "open"), ("change point", "antiparallelogram", "crossed")} <= seen
