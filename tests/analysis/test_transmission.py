"""Transmission angles against the law of cosines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, ConstantSpeed
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
        f"transmission angle {least:.6g} deg (crank at 0 deg) to {most:.6g} deg (crank at 180 deg): "
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
