"""`measure`: what it accepts and refuses, samples without numbers, several designs, ends of a motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError, RequestError
from kinfmu.mechanism.measures import (
    READINGS,
    Dwell,
    LowestMargin,
    Maximum,
    Minimum,
    PeakAcceleration,
    PeakSpeed,
    Range,
    Roundness,
    Straightness,
    TimeRatio,
    VelocityRatio,
)
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween
from kinfmu.motion import History, Motion

TURN = np.linspace(0.0, 2.0 * math.pi, 361)


def yoke_over(*angles: float) -> kinfmu.Run:
    return kinfmu.solve(kinfmu.load("scotch_yoke"), crank_angle=np.linspace(*angles, 100))


def test_the_ends_count_where_the_motion_does_not_go_round() -> None:
    found = kinfmu.measure(yoke_over(0.5, 2.0), [Range("r", "yoke.x"), PeakSpeed("v", "yoke.x")])
    assert found["r"].value == pytest.approx(40.0 * (math.cos(0.5) - math.cos(2.0)), rel=1e-12)
    assert found["r"].at == (2.0, 0.5)
    assert found["v"].at == pytest.approx((0.5 * math.pi,), abs=1e-9)


def test_descending_driver_values_give_the_same_numbers() -> None:
    up, down = (kinfmu.measure(yoke_over(*ends), [PeakAcceleration("a", "yoke.x")]) for ends in ((1, 5), (5, 1)))
    assert up["a"].value == pytest.approx(down["a"].value, rel=1e-12)
    assert up["a"].at == pytest.approx(down["a"].at, abs=1e-9)


def test_derived_quantities_are_measured_like_coordinates() -> None:
    run = kinfmu.solve(kinfmu.load("slider_crank"), crank_angle=TURN)
    distance = Range("d", DistanceBetween(("ground.O", "piston.S")))
    angle = Maximum("a", AngleBetween("crank", to="rod"), 0.0, 1.0)
    found = kinfmu.measure(run, [distance, angle, Range("x", "piston.x"), Maximum("w", "rod.omega")])
    assert found["d"].value == pytest.approx(found["x"].value, rel=1e-12)
    assert found["a"].value == pytest.approx(1.0 + math.asin(45.0 * math.sin(1.0) / 144.0), rel=1e-9)
    assert (found["a"].unit, found["w"].unit) == ("rad", "rad/rad")
    assert found["w"].value == pytest.approx(45.0 / 144.0, rel=1e-9)


def test_samples_without_numbers_give_nan_with_the_reason() -> None:
    run = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=np.radians(np.linspace(40.0, 140.0, 101)))
    assert not run.good.all()
    readings = [
        Maximum("m", "right.phi"),
        Straightness("s", "coupler.apex"),
        LowestMargin("g"),
        PeakSpeed("v", "right.phi"),
    ]
    for found in kinfmu.measure(run, readings).values():
        assert math.isnan(found.value)
        assert all(map(math.isnan, found.at))
        assert found.reason.startswith(f"{int((~run.good).sum())} of 101 samples have no numbers, the first at left = ")
        assert found.as_json()["value"] is None
    part = kinfmu.measure(run, [Maximum("m", "right.phi", "60 deg", "70 deg")])["m"]  # type: ignore[arg-type]  # text
    assert part.reason == ""
    assert math.radians(60.0) <= part.at[0] <= math.radians(70.0)


def test_many_designs_at_once_equal_each_alone() -> None:
    """Designs side by side, one of them with a sample without numbers: the others are not touched."""
    mechanism = kinfmu.load("crank_rocker")
    runs = [kinfmu.solve(mechanism, crank_angle=TURN + shift) for shift in (0.0, 0.3, 0.7)]
    alone = [Motion.of_run(run) for run in runs]
    tables = tuple(np.stack([motion.tables[k] for motion in alone]) for k in range(3))
    tables[0][2, 100] = np.nan
    margin = np.stack([run.margin for run in runs])
    many = replace(alone[0], tables=tables, sampled=lambda _: margin, _histories={})
    readings = (
        Range("", "rocker.phi"),
        PeakAcceleration("", "coupler.x"),
        TimeRatio("", "rocker.phi"),
        Dwell("", "rocker.phi", 0.1),
        Straightness("", "coupler.tracer", 1.0, 2.0),
        Roundness("", "coupler.tracer", 1.0, 2.0),
        VelocityRatio("", "rocker.phi"),
        LowestMargin(""),
    )
    for reading in readings:
        found = reading.read(many.part(reading.begin, reading.end)).value
        assert found.shape == (3,)
        first, second = (
            float(reading.read(replace(one, drive=alone[0].drive, x=alone[0].x).part(reading.begin, reading.end)).value)
            for one in alone[:2]
        )
        assert found[:2] == pytest.approx([first, second], rel=1e-11), reading.type
        assert np.isnan(found[2]) == (reading.type != "lowest_margin"), reading.type


def test_two_leading_axes_of_designs_keep_their_shape() -> None:
    x = np.linspace(0.0, 2.0 * math.pi, 181)
    phase = np.arange(6.0).reshape(2, 3, 1)
    history = History(x, np.sin(x - phase), np.cos(x - phase), -np.sin(x - phase), is_closed=True)
    high = history.maximum()
    assert high.value == pytest.approx(np.ones((2, 3)), rel=1e-12)
    assert high.x == pytest.approx((0.5 * math.pi + phase[..., 0]) % (2.0 * math.pi), abs=1e-9)


def test_two_extremes_between_two_samples_are_both_seen() -> None:
    x = np.array([0.0, 1.0, 2.0])
    curve = np.polynomial.Polynomial.fromroots([0.5, 0.9]).integ()  # rises, falls from 0.5 to 0.9, rises
    history = History(x, *(curve.deriv(order)(x) if order else curve(x) for order in range(3))).part(0.0, 1.0)
    assert history.maximum() == pytest.approx((curve(0.5), 0.5), abs=1e-14)
    assert history.minimum() == pytest.approx((0.0, 0.0), abs=1e-14)
    assert history.part(0.1, 1.0).negative().maximum().x == 0.1
    assert history.part(0.6, 1.0).minimum() == pytest.approx((curve(0.9), 0.9), abs=1e-14)


def test_a_crossing_at_the_end_of_a_closed_motion_is_seen_despite_rounding() -> None:
    value = np.cos(TURN + 0.2003)
    value[[0, -1]] = math.cos(0.2003) + np.array([-1e-13, 1e-13])
    history = History(TURN, value, -np.sin(TURN + 0.2003), -np.cos(TURN + 0.2003), is_closed=True)
    start, stop = history.stay(1.0 - math.cos(0.2003))
    assert float(stop - start) == pytest.approx(2.0 * 0.2003, rel=1e-9)


@pytest.mark.parametrize(
    ("readings", "message"),
    [
        (["strok"], "there is no measure 'strok'; measures: none"),
        ([TimeRatio("r", "yoke.x")], "[measures.r]: time_ratio needs a motion that goes round"),
        (
            [Minimum("m", "yoke.x", 0.0, 1.0)],
            "[measures.m]: the driver does not reach 0; the motion goes from 0.5 to 2",
        ),
    ],
)
def test_wrong_requests_name_the_measure(readings: list[object], message: str) -> None:
    with pytest.raises(RequestError) as error:
        kinfmu.measure(yoke_over(0.5, 2.0), readings)  # type: ignore[arg-type]
    assert str(error.value).startswith(message)


def test_an_unknown_coordinate_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(MechanismError, match=r"did you mean 'yoke\.x'"):
        kinfmu.measure(yoke_over(0.5, 2.0), [Minimum("m", "yoke.xx")])


def test_a_motion_of_several_drivers_is_measured_over_time() -> None:
    run = kinfmu.solve(kinfmu.load("five_bar"))
    assert kinfmu.measure(run, [LowestMargin("g")])["g"].driver == "time"


def test_every_type_of_measure_has_a_name_of_its_own() -> None:
    assert len({reading.type for reading in READINGS}) == len(READINGS)
